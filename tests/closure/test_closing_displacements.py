"""Lids that move the markers by themselves, and lids of which only the rim moves."""

from dataclasses import replace

import numpy as np
import pytest
from closing_world import (
    BLINKS,
    TIMES,
    markers,
    performance,
    result,
    slit_bound,
    slit_markers,
    with_human_lids,
    with_one_blink,
)
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


def both_eyes(face: BoundFace) -> tuple[LidApertures, LidApertures]:
    found = lid_apertures_of(face, NAMES)
    return found["left"], found["right"]


@pytest.mark.parametrize(("share", "own"), [(0.6, True), (1.4, True), (0.4, False), (1.6, False)])
def test_lids_that_move_markers_like_people_speak_for_themselves(share: float, own: bool) -> None:
    """Not those of eyes that are twice as large, which no performer moves as far."""
    face = slit_bound(with_human_lids(MESH, share))
    for apertures in both_eyes(face):
        assert bool(scanned_lid_displacements(face, apertures, NAMES)) is not own
        rig = face.offsets[NAMES.index(f"eyeBlink{apertures.eye.title()}")]
        found = closing_displacements(face, apertures, NAMES, face.markers[::-1])
        np.testing.assert_allclose(found, (rig if own else rig / share)[::-1], atol=1e-12)
        of_rig = closing_displacements(face, apertures, NAMES, face.markers, of_rig=True)
        np.testing.assert_array_equal(of_rig, rig)


@pytest.mark.parametrize(("share", "own"), [(1.0, True), (2.0, False)])
def test_one_shape_may_close_both_eyes(share: float, own: bool) -> None:
    face = slit_bound(with_one_blink(with_human_lids(MESH, share)))
    for apertures in lid_apertures_of(face, face.shape_names).values():
        assert bool(scanned_lid_displacements(face, apertures, face.shape_names)) is not own


def test_beside_lids_whose_rim_alone_moves_markers_move_as_on_another_face() -> None:
    face = slit_bound(rim_face())
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
        assert near_lids(face, apertures, closing)[upper]


def test_without_markers_near_the_eyes_nothing_is_known() -> None:
    mesh = rim_face()
    places = {n: v for n, v in slit_markers(mesh).items() if not n.startswith("eye")}
    points = np.array(list(places.values()))
    face = BoundFace(mesh, tuple(places), points, nose_tip="mouth_up").with_layout(())
    for apertures in both_eyes(face):
        assert not scanned_lid_displacements(face, apertures, NAMES)
        closing = closing_displacements(face, apertures, NAMES, face.markers)
        assert not near_lids(face, apertures, closing).any()


@pytest.mark.parametrize(
    ("share", "looks", "own"), [(1.0, True, True), (1.0, False, False), (2.0, True, False)]
)
def test_lids_follow_eyes_that_look_down_unless_the_rig_says_how(
    share: float, looks: bool, own: bool
) -> None:
    """A rig whose lids move unlike people's does not say how people's follow, either."""
    face = slit_bound(with_human_lids(MESH, share, looks))
    names = face.shape_names
    for apertures in lid_apertures_of(face, names).values():
        glance = scanned_glance_displacements(face, apertures, names)
        assert (glance is None) is own
        if glance is not None:
            upper = face.markers.index(f"eye_{apertures.eye}_up")
            assert glance[upper, 1] < -0.1 * apertures.opening
            (other,) = set(EYES) - {apertures.eye}
            assert not glance[face.markers.index(f"eye_{other}_up")].any()


def test_a_marker_that_a_performer_moves_is_near_the_lids_of_eyes_of_any_size() -> None:
    face = slit_bound(MESH)
    left, _ = both_eyes(face)
    closing, person = np.zeros((len(face.markers), 3)), 0.0075 * face.size
    for opening, performed in ((0.004, 0.004), (0.02, person)):
        for share, near in ((0.09, False), (0.11, True)):
            closing[2, 1] = -share * performed
            assert near_lids(face, replace(left, opening=opening), closing)[2] == near


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
