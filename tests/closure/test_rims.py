"""Pairs of points on two rims that touch in a pose."""

import numpy as np
from slits import LID_GAP, slit_face

from usdface.closure.rims import rim_pairs
from usdface.face.bound_face import BoundFace


def left_eye() -> tuple[np.ndarray, np.ndarray]:
    mesh = slit_face()
    lids = BoundFace(mesh, (), np.zeros(0, int)).with_layout(()).layout.lids
    lids = lids[mesh.points[lids[:, 0], 0] > 0]
    closed = mesh.points.copy()
    shape = next(s for s in mesh.shapes if s.name == "eyeBlinkLeft")
    closed[shape.indices] += shape.offsets
    return lids, closed


def test_pairs_are_apart_where_the_eye_is_open_and_meet_where_it_is_closed() -> None:
    mesh = slit_face()
    lids, closed = left_eye()
    pairs = rim_pairs(mesh, lids, closed, 0.25 * LID_GAP)
    vertices = pairs.vertices
    shut = pairs.apertures(vertices, closed[vertices].reshape(-1))
    np.testing.assert_allclose(shut, 0.0, atol=1e-9)
    opened = pairs.apertures(vertices, mesh.points[vertices].reshape(-1))
    assert (opened[opened > 1e-6] > LID_GAP / 2).all() and opened.max() <= LID_GAP + 1e-9


def test_gaps_are_linear_and_blind_to_a_move_of_the_whole_face() -> None:
    mesh = slit_face()
    lids, closed = left_eye()
    pairs = rim_pairs(mesh, lids, closed, 0.25 * LID_GAP)
    vertices = pairs.vertices
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 3 * len(vertices)))
    np.testing.assert_allclose(
        pairs.apertures(vertices, np.stack([a, b, a + 2 * b])),
        np.stack(
            [
                pairs.apertures(vertices, a),
                pairs.apertures(vertices, b),
                pairs.apertures(vertices, a) + 2 * pairs.apertures(vertices, b),
            ]
        ),
        atol=1e-12,
    )
    shift = np.tile([0.3, -0.2, 0.1], len(vertices))
    np.testing.assert_allclose(
        pairs.apertures(vertices, a + shift), pairs.apertures(vertices, a), atol=1e-12
    )
