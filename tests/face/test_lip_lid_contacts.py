"""Lips and lids are found where a mesh that was built with them has them, and nowhere else."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from ict_face import ict_mesh
from slits import LID_GAP, LIP_GAP, slit_face

from usdface.face import lip_lid_contacts
from usdface.face.lip_lid_contacts import find_lip_lid_contacts, widest_pair
from usdface.rigs import BlendShape, Mesh

FACE = slit_face()
SEAMS = find_lip_lid_contacts(FACE)


def test_every_pair_of_lips_and_lids_is_found_and_no_other():
    upper, lower = FACE.points[SEAMS.lips].swapaxes(0, 1)
    np.testing.assert_allclose(upper - lower, np.tile([0, LIP_GAP, 0], (18, 1)), atol=1e-12)
    upper, lower = FACE.points[SEAMS.lids].swapaxes(0, 1)
    np.testing.assert_allclose(upper - lower, np.tile([0, LID_GAP, 0], (36, 1)), atol=1e-12)


def test_the_lids_of_an_eye_are_those_on_its_side_and_the_widest_pair_is_one_of_them():
    for side in (1, -1):
        lids = SEAMS.lids_of_eye(FACE.points, side, 0.0)
        assert len(lids) == 18
        assert (side * FACE.points[lids, 0] > 0.0).all()
    raised = FACE.points.copy()
    raised[lids[5, 0], 1] += LID_GAP
    assert widest_pair(raised, lids).tolist() == lids[5].tolist()


def test_shapes_that_hardly_move_anything_touch_nothing():
    shapes = tuple(replace(shape, offsets=1e-4 * shape.offsets) for shape in FACE.shapes)
    assert not any(map(len, find_lip_lid_contacts(replace(FACE, shapes=shapes))))


def test_it_does_not_hang_on_the_order_of_vertices_or_the_size_of_the_face():
    order = np.random.default_rng(0).permutation(len(FACE.points))
    place = np.argsort(order)
    shapes = []
    for shape in FACE.shapes:
        dense = np.zeros(FACE.points.shape)
        dense[shape.indices] = shape.offsets
        shapes.append(BlendShape.from_dense(shape.name, 40 * dense[order]))
    shuffled = replace(
        FACE,
        points=40 * FACE.points[order],
        face_indices=place[FACE.face_indices],
        shapes=tuple(shapes),
    )
    for found, expected in zip(find_lip_lid_contacts(shuffled), SEAMS, strict=True):
        assert {(order[a], order[b]) for a, b in found} == {tuple(pair) for pair in expected}


@pytest.mark.parametrize("missing", ["jawOpen", "eyeBlink"])
def test_without_the_shape_that_moves_it_a_seam_is_not_known(missing):
    opening = ("jawOpen", "mouthUpperUp", "mouthSmile") if missing == "jawOpen" else (missing,)
    kept = tuple(s for s in FACE.shapes if not s.name.startswith(opening))
    lips, lids, _ = find_lip_lid_contacts(replace(FACE, shapes=kept))
    assert (len(lips) > 0) == (missing != "jawOpen")
    assert (len(lids) > 0) == (missing != "eyeBlink")


def opened_mouth(weight: float) -> Mesh:
    """The face with a mouth that rests open, and a shape that closes it."""
    jaw = next(s for s in FACE.shapes if s.name == "jawOpen")
    points = FACE.points.copy()
    points[jaw.indices] += weight * jaw.offsets
    rest = tuple(
        replace(s, offsets=(1 - weight) * s.offsets) if s is jaw else s for s in FACE.shapes
    )
    closing = BlendShape("mouthClose", jaw.indices, -weight * jaw.offsets)
    return replace(FACE, points=points, shapes=(*rest, closing))


@pytest.mark.parametrize("weight", [0.3, 0.6])
def test_the_seam_of_a_mouth_that_rests_open_is_none_of_lids(weight):
    lips, lids, _ = find_lip_lid_contacts(opened_mouth(weight))
    assert not len(lips)
    np.testing.assert_array_equal(lids, SEAMS.lids)


@pytest.mark.parametrize("weight", [0.1, 0.15, 0.2, 0.3])
def test_lips_of_a_mouth_that_rests_open_meet_where_its_opening_plays_backwards(weight):
    opened = opened_mouth(weight)
    for shapes in (opened.shapes, opened.shapes[:-1]):  # with a shape that closes it, or none
        found = find_lip_lid_contacts(replace(opened, shapes=shapes))
        across = np.sort(opened.points[found.mouth, 0].mean(axis=1))
        rest = np.sort(FACE.points[SEAMS.mouth, 0].mean(axis=1))
        assert across[0] == pytest.approx(rest[0]) and across[-1] == pytest.approx(rest[-1])
        assert set(found.mouth.ravel()) <= set(SEAMS.mouth.ravel())
        np.testing.assert_array_equal(found.lids, SEAMS.lids)
    assert not len(SEAMS.open_lips)


@pytest.mark.parametrize("weight", [0.1, 0.3, 0.5])
def test_an_ict_mouth_that_rests_open_is_as_wide_as_a_closed_one(shared_data, weight):
    """At 0.1 only its corners touch, which would be a mouth at each."""
    mesh = ict_mesh(shared_data)
    jaw = next(s for s in mesh.shapes if s.name == "jawOpen")
    points = mesh.points.copy()
    points[jaw.indices] += weight * jaw.offsets
    rest = replace(jaw, offsets=(1 - weight) * jaw.offsets, normal_offsets=None)
    shapes = tuple(rest if s is jaw else s for s in mesh.shapes)
    found = find_lip_lid_contacts(replace(mesh, points=points, shapes=shapes))
    closed = find_lip_lid_contacts(mesh)
    assert len(found.lips) < 10 < len(found.open_lips)
    for pairs in (found.mouth, closed.mouth):
        at = mesh.points[pairs]  # the same vertices on the closed mouth
        assert np.ptp(at[..., 0]) == pytest.approx(0.046, abs=0.004)
        assert np.abs(np.diff(at[..., 1], axis=1)).max() < 0.004
    assert mesh.points[found.lids, 1].min() > mesh.points[closed.lids, 1].min() - 0.002


def dense(name: str) -> np.ndarray:
    shape = next(s for s in FACE.shapes if s.name == name)
    offsets = np.zeros(FACE.points.shape)
    offsets[shape.indices] = shape.offsets
    return offsets


@pytest.mark.parametrize("kept", [True, False])
def test_a_shape_that_closes_an_open_mouth_and_the_eyes_takes_no_lids(kept):
    face = opened_mouth(0.4)
    lids = dense("eyeBlinkLeft") + dense("eyeBlinkRight")
    asleep = BlendShape.from_dense("asleep", lids - 0.4 * dense("jawOpen"))
    shapes = tuple(s for s in face.shapes if kept or s.name != "mouthClose")
    found = find_lip_lid_contacts(replace(face, shapes=(*shapes, asleep)))
    np.testing.assert_array_equal(found.lids, SEAMS.lids)


def test_a_blink_that_lowers_most_of_the_skin_but_not_the_lips_closes_an_eye():
    still = np.abs(FACE.points[:, 1]) < 0.02
    shapes = []
    for shape in FACE.shapes:
        if shape.name.startswith("eyeBlink"):
            offsets = dense(shape.name)
            offsets[~still & ~offsets.any(axis=1)] = (0, -0.001, 0)
            shape = BlendShape.from_dense(shape.name, offsets)
        shapes.append(shape)
    found = find_lip_lid_contacts(replace(FACE, shapes=tuple(shapes)))
    np.testing.assert_array_equal(found.lids, SEAMS.lids)


def test_shapes_that_all_move_the_whole_face_a_little_still_close_its_eyes():
    drift = 0.002 * np.random.default_rng(0).normal(size=(len(FACE.shapes), 3))
    offsets = FACE.offsets_at(np.arange(len(FACE.points))) + drift[:, None]
    shapes = (BlendShape.from_dense(s.name, o) for s, o in zip(FACE.shapes, offsets, strict=True))
    found = find_lip_lid_contacts(replace(FACE, shapes=tuple(shapes)))
    np.testing.assert_array_equal(found.lids, SEAMS.lids)
    np.testing.assert_array_equal(found.lips, SEAMS.lips)


def test_a_sheet_without_holes_has_no_seams():
    x, y = np.meshgrid(np.linspace(0, 0.1, 8), np.linspace(0, 0.1, 8))
    points = np.stack([x, y, np.zeros(x.shape)], axis=-1).reshape(-1, 3)
    first = (np.arange(7)[:, None] * 8 + np.arange(7)).ravel()
    quads = np.stack([first, first + 1, first + 9, first + 8], axis=1)
    moved = BlendShape("up", np.arange(20), np.tile([0, 0.02, 0], (20, 1)))
    sheet = Mesh("sheet", points, np.full(49, 4), quads.ravel(), shapes=(moved,))
    for mesh in (sheet, replace(sheet, shapes=())):
        assert [len(pairs) for pairs in find_lip_lid_contacts(mesh)] == [0, 0, 0]


@pytest.mark.slow
def test_the_ict_face_has_lips_and_two_eyes(shared_data):
    mesh = ict_mesh(shared_data)
    lips, lids, _ = find_lip_lid_contacts(mesh)
    middle = 1000 * mesh.points[lips].mean(axis=1)
    assert len(lips) >= 40 and np.ptp(middle[:, 0]) > 35 and np.ptp(middle[:, 1]) < 5
    sides = mesh.points[lids, 0].mean(axis=1)
    assert (sides > 0).sum() >= 40 and (sides < 0).sum() >= 40
    assert np.ptp(1000 * mesh.points[lids, 1]) < 20


@pytest.mark.parametrize("far", [1.0, 100.0, 1e6])
def test_a_vertex_far_off_hides_no_lips_and_no_lids(far):
    points = FACE.points.copy()
    lone = np.setdiff1d(FACE.shapes[0].indices, np.concatenate([*SEAMS.lips, *SEAMS.lids]))[0]
    points[lone] += far
    found = find_lip_lid_contacts(replace(FACE, points=points))
    np.testing.assert_array_equal(found.lips, SEAMS.lips)
    np.testing.assert_array_equal(found.lids, SEAMS.lids)


def test_they_are_searched_once_for_a_mesh_and_kept_no_longer_than_it(monkeypatch):
    searched = []
    find = lip_lid_contacts._find
    monkeypatch.setattr(lip_lid_contacts, "_find", lambda m: (searched.append(1), find(m))[1])
    mesh = replace(FACE)
    held = weakref.ref(mesh)
    first, again = find_lip_lid_contacts(mesh), find_lip_lid_contacts(mesh)
    assert first is again and len(searched) == 1 and not first.lids.flags.writeable
    np.testing.assert_array_equal(first.lids, SEAMS.lids)
    del mesh
    gc.collect()
    assert held() is None
