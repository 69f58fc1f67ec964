from dataclasses import replace

import numpy as np
import pytest
from skins import make_head

from usdface.blend_shapes.blend_shape import BlendShape, Combination, Inbetween
from usdface.face.marker_surface import MarkerSurface
from usdface.face.transferred_shapes import transferred_surface
from usdface.rigs import Mesh

HEAD = make_head()
ON = HEAD.surface.at(np.zeros((len(HEAD.vertices), 3)))


def bend(points: np.ndarray) -> np.ndarray:
    return points * [1.05, 0.97, 1.15] + 0.002 * np.sin(25 * points[:, [1, 2, 0]])


def carried(rest: np.ndarray, surface: MarkerSurface = HEAD.surface) -> MarkerSurface:
    result = transferred_surface(surface, ON, rest)
    assert result is not None
    return result


def at_markers(surface: MarkerSurface) -> np.ndarray:
    return surface.mesh.offsets_at(surface.vertices)


def test_the_same_face_moves_as_the_character() -> None:
    np.testing.assert_allclose(
        at_markers(carried(HEAD.points)), at_markers(HEAD.surface), atol=1e-9
    )


def test_markers_show_another_face_nearly_as_its_whole_mesh_would() -> None:
    patch = HEAD.surface.patch
    shapes = HEAD.mesh.offsets_at(patch.vertices)
    exact = patch.transferred(bend(patch.points), shapes)[:, patch.place_of[HEAD.vertices]]
    found = at_markers(carried(bend(HEAD.points)))
    before = np.abs(at_markers(HEAD.surface) - exact).mean()
    assert np.abs(found - exact).mean() < 0.4 * before


def test_only_the_shapes_are_others_and_the_character_is_unchanged() -> None:
    before = at_markers(HEAD.surface).copy()
    other = carried(bend(HEAD.points))
    np.testing.assert_array_equal(other.mesh.points, HEAD.mesh.points)
    np.testing.assert_array_equal(other.vertices, HEAD.vertices)
    assert other.mesh.shape_names == HEAD.mesh.shape_names
    np.testing.assert_array_equal(at_markers(HEAD.surface), before)
    assert np.abs(at_markers(other) - before).max() > 1e-4


def test_inbetweens_and_combinations_go_with_their_shapes() -> None:
    first, second, *others = HEAD.mesh.shapes
    half = replace(first, inbetweens=(Inbetween("half", 0.4, 0.4 * first.offsets),))
    mixed = replace(second, combination=Combination((first.name, others[0].name)))
    mesh = replace(HEAD.mesh, shapes=(half, mixed, *others))
    other = carried(bend(HEAD.points), MarkerSurface(mesh, HEAD.vertices)).mesh.shapes
    assert other[1].combination == mixed.combination
    (inbetween,) = other[0].inbetweens
    assert (inbetween.name, inbetween.weight) == ("half", 0.4)
    # Nearly linear in a small shape.
    off = np.abs(inbetween.offsets - 0.4 * other[0].offsets).max()
    assert off < 0.05 * np.abs(other[0].offsets).max()


@pytest.mark.slow
def test_a_mesh_without_faces_or_too_fine_has_none() -> None:
    none = np.zeros(0, np.int64)
    bare = replace(HEAD.mesh, face_counts=none, face_indices=none)
    assert transferred_surface(MarkerSurface(bare, HEAD.vertices), ON, HEAD.points) is None
    many = tuple(BlendShape(f"s{k}", none, np.zeros((0, 3))) for k in range(30_000))
    fine = Mesh("m", HEAD.mesh.points, HEAD.mesh.face_counts, HEAD.mesh.face_indices, shapes=many)
    assert transferred_surface(MarkerSurface(fine, HEAD.vertices), ON, HEAD.points) is None
