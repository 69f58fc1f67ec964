from dataclasses import replace

import numpy as np
import pytest
from curved_world import COMBINED, make_curved_world
from slits import EXPRESSIONS, slit_face

from usdface.errors import InputError
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.layout import find_layout
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

WORLD = make_curved_world(head_moves=False)
MESH = WORLD.rig.face()
BINDING = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))
SETUP = RetargetSetup(BINDING, nose_tip="nose", roles={"tip": "nose"})
FACE = bound_face(MESH, SETUP)


def test_it_shows_the_take_it_was_recorded_on() -> None:
    moved = FACE.displacements(WORLD.weights)
    np.testing.assert_allclose(FACE.neutral + moved, WORLD.take.positions, atol=1e-12)


def test_combination_shapes_follow_their_parents_whatever_they_are_given() -> None:
    wrong = WORLD.weights.copy()
    wrong[:, [MESH.shape_names.index(name) for name in COMBINED]] = 0.7
    expected = FACE.displacements(WORLD.weights)
    np.testing.assert_array_equal(FACE.displacements(wrong), expected)


def test_markers_and_their_vertices() -> None:
    assert dict(FACE.vertex_of) == WORLD.points
    names = BINDING.markers[4:1:-1]
    assert FACE.vertices_of(names).tolist() == [WORLD.points[name] for name in names]
    assert FACE.vertices_of(()).shape == (0,)
    np.testing.assert_array_equal(FACE.offsets, MESH.offsets_at(BINDING.points))
    assert FACE.rig_shapes == FACE.shape_names == MESH.shape_names


def test_the_nose_tip_is_on_the_midline() -> None:
    assert FACE.markers[FACE.nose] == "nose"
    assert FACE.midline == MESH.points[WORLD.points["nose"], 0]
    without = replace(FACE, nose_tip="")
    assert without.midline == 0.0
    with pytest.raises(InputError, match="no nose tip"):
        _ = without.nose


def test_its_layout_is_found_on_the_mesh() -> None:
    mesh = slit_face()
    face = bound_face(mesh, RetargetSetup(Binding((), np.zeros(0, int)))).with_layout(EXPRESSIONS)
    found = find_layout(mesh, EXPRESSIONS, 0.0)
    assert face.layout.left == found.left and face.layout.lips.tolist() == found.lips.tolist()


def test_nothing_of_it_can_be_changed() -> None:
    with pytest.raises(AttributeError):
        FACE.nose_tip = "chin"  # type: ignore[misc]
    for array in (FACE.vertices, FACE.neutral, FACE.offsets):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        FACE.roles["tip"] = "chin"  # type: ignore[index]


def test_a_face_without_markers_has_no_places() -> None:
    face = BoundFace(MESH, (), np.zeros(0, int))
    assert face.displacements(WORLD.weights).shape == (len(WORLD.weights), 0, 3)


def test_a_face_at_human_size_is_the_same_from_any_size() -> None:
    small, large = (
        BoundFace(slit_face().scaled(k), ("m",), np.array([3])).with_layout(EXPRESSIONS)
        for k in (0.5, 4.0)
    )
    assert large.size == pytest.approx(8 * small.size)
    one, other = small.at_human_size(), large.at_human_size()
    assert one.size == other.size == pytest.approx(1.0)
    np.testing.assert_allclose(one.mesh.points, other.mesh.points, rtol=1e-12)
    np.testing.assert_allclose(one.offsets, other.offsets, rtol=1e-12)
    assert one.layout.tolerance == pytest.approx(other.layout.tolerance)


def test_a_face_without_lids_counts_as_human() -> None:
    bare = replace(MESH, shapes=())
    face = BoundFace(bare, (), np.zeros(0, int))
    assert face.size == 1.0 and face.at_human_size() is face


def test_the_size_of_a_face_is_that_of_its_mesh_whatever_the_layout_has() -> None:
    face = BoundFace(slit_face().scaled(2.0), (), np.zeros(0, int))
    laid = face.with_layout(EXPRESSIONS)
    bare = replace(laid, layout=replace(laid.layout, lids=laid.layout.lids[:0], tolerance=None))
    assert face.size == laid.size == bare.size == pytest.approx(2 * 0.07 / 0.063)
    assert face.tolerance == bare.tolerance == pytest.approx(laid.tolerance)
    assert laid.tolerance == pytest.approx(0.0005 * laid.size)
