"""Lids that move the markers by themselves, and lids of which only the rim moves."""

from dataclasses import replace

import numpy as np
import pytest
from closing_world import BLINKS, TIMES, markers, performance, result, slit_markers
from slits import slit_face

from usdface.closure.closing_displacements import (
    closing_displacements,
    near_lids,
    scanned_glance_displacements,
    scanned_lid_displacements,
)
from usdface.closure.lid_apertures import EYES, LidApertures, lid_apertures_of
from usdface.face.bound_face import BoundFace
from usdface.rigs import BlendShape, Mesh

MESH = slit_face()
NAMES = MESH.shape_names


def rim_face() -> Mesh:
    """Return the face whose eyes close by their rims alone; no marker is there."""
    shapes = []
    for shape in MESH.shapes:
        dense = np.zeros_like(MESH.points)
        dense[shape.indices] = shape.offsets
        if shape.name.startswith("eye"):
            dense[np.abs(MESH.points[:, 1] - 0.07) > 0.0041] = 0.0
        shapes.append(BlendShape.from_dense(shape.name, dense))
    return replace(MESH, shapes=tuple(shapes))


def bound(mesh: Mesh) -> BoundFace:
    places = slit_markers(mesh)
    points = np.array(list(places.values()))
    return BoundFace(mesh, tuple(places), points, nose_tip="mouth_up").with_layout(())


def both_eyes(face: BoundFace) -> tuple[LidApertures, LidApertures]:
    found = lid_apertures_of(face, NAMES)
    return found["left"], found["right"]


def test_lids_that_move_markers_speak_for_themselves() -> None:
    face = bound(MESH)
    for apertures in both_eyes(face):
        assert not scanned_lid_displacements(face, apertures, NAMES)
        own = face.offsets[NAMES.index(f"eyeBlink{apertures.eye.title()}")]
        found = closing_displacements(face, apertures, NAMES, face.markers[::-1])
        np.testing.assert_array_equal(found, own[::-1])


def test_beside_lids_whose_rim_alone_moves_markers_move_as_on_another_face() -> None:
    face = bound(rim_face())
    for apertures in both_eyes(face):
        known = scanned_lid_displacements(face, apertures, NAMES)
        assert set(known) == {apertures.closer, *apertures.tighteners, *apertures.raisers}
        upper = face.markers.index(f"eye_{apertures.eye}_up")
        closing = closing_displacements(face, apertures, NAMES, face.markers)
        np.testing.assert_array_equal(closing, known[apertures.closer])
        # Down by a good part of the opening, up where the lid is raised; the other eye not at all.
        assert -1.5 * apertures.opening < closing[upper, 1] < -0.2 * apertures.opening
        assert known[apertures.raisers[0]][upper, 1] > 0
        (other,) = set(EYES) - {apertures.eye}
        assert not closing[face.markers.index(f"eye_{other}_up")].any()
        assert near_lids(closing, apertures)[upper]


def test_without_markers_near_the_eyes_nothing_is_known() -> None:
    mesh = rim_face()
    places = {n: v for n, v in slit_markers(mesh).items() if not n.startswith("eye")}
    points = np.array(list(places.values()))
    face = BoundFace(mesh, tuple(places), points, nose_tip="mouth_up").with_layout(())
    for apertures in both_eyes(face):
        assert not scanned_lid_displacements(face, apertures, NAMES)
        closing = closing_displacements(face, apertures, NAMES, face.markers)
        assert not near_lids(closing, apertures).any()


def test_lids_follow_eyes_that_look_down_unless_the_rig_says_how() -> None:
    face = bound(MESH)
    for apertures in both_eyes(face):
        upper = face.markers.index(f"eye_{apertures.eye}_up")
        glance = scanned_glance_displacements(face, apertures, NAMES)
        assert glance is not None and glance[upper, 1] < -0.1 * apertures.opening
        (other,) = set(EYES) - {apertures.eye}
        assert not glance[face.markers.index(f"eye_{other}_up")].any()
    own = tuple(
        BlendShape(f"eyeLookDown{side}", shape.indices, 0.5 * shape.offsets)
        for shape in MESH.shapes
        for side in ("Left", "Right")
        if shape.name == f"eyeBlink{side}"
    )
    looking = bound(replace(MESH, shapes=(*MESH.shapes, *own)))
    names = looking.shape_names
    for apertures in lid_apertures_of(looking, names).values():
        assert scanned_glance_displacements(looking, apertures, names) is None


def test_a_performer_blinks_on_a_rig_whose_lids_move_no_marker() -> None:
    mesh = rim_face()
    shot = result(markers(MESH, performance(NAMES)), mesh=mesh)
    assert shot.closure is not None
    peaks = [each.closing.closed for each in shot.closure.closings]
    assert peaks == pytest.approx([start + 0.09 for start in BLINKS], abs=0.05)
    for apertures in lid_apertures_of(shot.shot.face.with_contacts(), NAMES).values():
        widest = apertures.widest(shot.weights.weights)
        assert widest.min() < 1e-4 and widest[TIMES < 0.9].min() > 0.9 * apertures.opening
    codes = [finding.code for finding in shot.closure.findings]
    assert codes.count("LIDS_GUESSED") == 2 and "LIDS_UNSEEN" not in codes
