"""Candidate vertices depend on the face alone, not on where it stands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface.binding.candidates import candidate_vertices
from usdface.binding.face_surface import face_surface
from usdface.io.usd.rig import read_rig
from usdface.rigs import BlendShape, Mesh

HEAD = Path(__file__).resolve().parents[2] / "examples" / "head.usdc"


@pytest.fixture(scope="module")
def head() -> Mesh:
    return read_rig(HEAD)[0].face()


@pytest.mark.parametrize("away", [(1e-6, 0.0, 0.0), (0.0, 1.7, 0.0), (-3.0, 1.234, 0.77)])
def test_a_moved_face_has_the_same_candidates(head: Mesh, away: tuple[float, ...]) -> None:
    moved = replace(head, points=head.points + away)
    here, there = (candidate_vertices(face_surface(mesh), 0.1) for mesh in (head, moved))
    np.testing.assert_array_equal(there.indices, here.indices)
    np.testing.assert_allclose(there.points, here.points, atol=1e-12)
    np.testing.assert_allclose(there.centre - here.centre, away, atol=1e-12)


def test_the_order_of_the_vertices_does_not_choose_them(head: Mesh) -> None:
    """As of the same head from another program."""
    order = np.random.default_rng(1).permutation(len(head.points))
    place = np.argsort(order)
    shapes = []
    for shape in head.shapes:
        rows = np.argsort(place[shape.indices])
        shapes.append(BlendShape(shape.name, place[shape.indices][rows], shape.offsets[rows]))
    indices = place[head.face_indices]
    other = Mesh("head", head.points[order], head.face_counts, indices, shapes=tuple(shapes))
    here, there = (face_surface(mesh) for mesh in (head, other))
    for cell in (0.1, 0.03):
        one, two = (candidate_vertices(surface, cell) for surface in (here, there))
        # By their places: where lips touch two vertices have the same.
        places = [head.points[here.vertices[one.indices]]]
        places.append(head.points[order[there.vertices[two.indices]]])
        expected, found = (np.unique(own, axis=0) for own in places)
        np.testing.assert_array_equal(found, expected)


def test_a_cell_has_one_candidate(head: Mesh) -> None:
    surface = face_surface(head)
    coarse, fine = (candidate_vertices(surface, cell) for cell in (0.2, 0.1))
    assert len(coarse.indices) < len(fine.indices) < len(surface.vertices)
    middle = 0.5 * (surface.points.min(axis=0) + surface.points.max(axis=0))
    cells = np.rint((surface.points - middle) / (0.1 * fine.size))
    assert len(fine.indices) == len(np.unique(cells, axis=0))
    assert len(np.unique(cells[fine.indices], axis=0)) == len(fine.indices)


def test_vertices_that_are_kept_are_candidates(head: Mesh) -> None:
    surface = face_surface(head)
    kept = np.arange(0, len(surface.vertices), 7)
    found = candidate_vertices(surface, 0.2, kept)
    assert np.isin(kept, found.indices).all()
