"""A marker is drawn by the skin around it, not by the number of vertices there."""

from dataclasses import replace

import numpy as np
from worlds import make_world

from usdface.binding.alignment import align
from usdface.binding.candidates import CandidateVertices, candidate_vertices
from usdface.binding.face_surface import face_surface
from usdface.binding.observations import Observations
from usdface.binding.registration import Registration

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
CANDIDATES = candidate_vertices(face_surface(MESH))
AT = np.array(list(WORLD.points.values()))
COUNT, PEAKS = len(AT), len(MESH.shapes)
OBSERVED = Observations(
    1.05 * MESH.points[AT],
    MESH.offsets_at(AT),
    np.ones((PEAKS, COUNT), dtype=bool),
    np.ones(COUNT, dtype=bool),
    np.full(COUNT, -1),
    np.full(COUNT, np.nan),
)
START = Registration(
    linear=np.eye(3),
    offset=-CANDIDATES.centre,
    bend=np.zeros((COUNT, 3)),
    weights=np.zeros((PEAKS, PEAKS)),
    rigid=np.zeros((PEAKS, 6)),
    assigned=np.zeros(COUNT, dtype=np.int64),
    marker_costs=np.zeros(COUNT),
    cost=np.inf,
)


def split(candidates: CandidateVertices, times: int) -> CandidateVertices:
    """Candidates whose upper half is so many vertices each, which share the skin of the one."""
    upper = candidates.points[:, 1] > 0.0
    counts = np.where(upper, times, 1)
    twice = np.repeat(np.arange(len(upper)), counts)
    return replace(
        candidates,
        indices=candidates.indices[twice],
        points=candidates.points[twice],
        offsets=candidates.offsets[:, twice],
        rigid_motions=candidates.rigid_motions[:, twice],
        areas=(candidates.areas / counts)[twice],
    )


def test_more_vertices_on_the_same_skin_draw_no_marker() -> None:
    whole, fine = (
        align(candidates, OBSERVED, START, shape_error=0.2, motion_error=0.1)
        for candidates in (CANDIDATES, split(CANDIDATES, 5))
    )
    for name in ("linear", "offset", "bend", "weights"):
        np.testing.assert_allclose(getattr(fine, name), getattr(whole, name), atol=1e-9)


def test_coarse_skin_draws_no_more_than_a_disc() -> None:
    surface = CANDIDATES.surface
    areas = CANDIDATES.areas
    assert (areas <= surface.areas).all() and (areas < surface.areas).any()
    np.testing.assert_allclose(areas.max(), np.pi * (0.027 * CANDIDATES.size) ** 2)
    wide = candidate_vertices(replace(surface, areas=3.0 * surface.areas)).areas
    np.testing.assert_array_equal(wide[areas == areas.max()], areas.max())
