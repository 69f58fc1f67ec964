"""How much of the opening between the lids is gone, as the blend shapes together explain it."""

from dataclasses import replace

import numpy as np
import pytest
from closing_world import BLINKS, TIMES, markers, performance, result, with_one_blink
from slits import slit_face

from usdface.closure.closing_displacements import scanned_glance_displacements
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.lid_estimate import lid_estimate
from usdface.shot.shot import ShotResult

MESH = slit_face()
NAMES = MESH.shape_names


def estimate_of(shot: ShotResult) -> np.ndarray:
    face = shot.shot.face
    assert shot.solution is not None
    return lid_estimate(face, lid_apertures_of(face, NAMES), NAMES, shot.solution).gone


def test_all_of_the_opening_is_gone_in_a_blink_and_nothing_at_rest() -> None:
    estimate = estimate_of(result(markers(MESH, performance(NAMES), as_people=True)))
    peaks = [int((start + 0.09) * 60) for start in BLINKS]
    np.testing.assert_allclose(estimate[peaks], 1.0, atol=0.12)
    assert np.abs(estimate[TIMES < 0.9]).max() < 0.05


@pytest.mark.slow
def test_it_is_in_proportion_and_of_each_eye() -> None:
    weights = performance(NAMES)
    weights[:, NAMES.index("eyeBlinkRight")] = 0.0
    estimate = estimate_of(result(markers(MESH, weights, share=0.5, as_people=True)))
    np.testing.assert_allclose(estimate.max(axis=0), [0.5, 0.0], atol=0.1)


@pytest.mark.slow
def test_an_eye_without_markers_is_not_seen() -> None:
    estimate = estimate_of(result(markers(MESH, performance(NAMES), without=("eye_right",))))
    assert np.isnan(estimate[:, 1]).all() and np.isfinite(estimate[:, 0]).all()


@pytest.mark.slow
def test_eyes_that_may_look_down_need_not_be_closed() -> None:
    """Markers that move as a scanned face's do under a glance, on a rig that only blinks."""
    face = result(markers(MESH, performance(NAMES))).shot.face
    apertures = lid_apertures_of(face, NAMES)
    take = markers(MESH, np.zeros_like(performance(NAMES)))
    own = [face.markers.index(name) for name in take.names]
    positions = take.positions.copy()
    for aperture in apertures.values():
        glance = scanned_glance_displacements(face, aperture, NAMES)
        assert glance is not None
        positions[120:240] += 1.5 * glance[own]
    shot = result(replace(take, positions=positions))
    assert shot.solution is not None
    looks = lid_estimate(face, apertures, NAMES, shot.solution).gone
    assert np.abs(looks[:100]).max() < 0.05
    # Not all of a glance is told from a blink by three markers beside an eye.
    assert looks[150:200].mean() == pytest.approx(1.5 * 0.47, abs=0.15)


def test_it_is_surer_the_more_markers_show_the_lids() -> None:
    """Never less sure than without any, and surest of an eye whose markers all are there."""
    deviations = []
    for without in ((), ("eye_left_in",), ("eye_left_in", "eye_left_down")):
        shot = result(markers(MESH, performance(NAMES), without=without))
        face = shot.shot.face
        assert shot.solution is not None
        apertures = lid_apertures_of(face, NAMES)
        deviations.append(lid_estimate(face, apertures, NAMES, shot.solution).deviation)
    left, right = np.array(deviations).T
    assert (np.diff(left) > 0.0).all() and left[-1] < 1.0
    assert (right < left)[1:].all()


def test_one_shape_closes_both_eyes() -> None:
    """Of a rig whose lids move unlike people's: each eye's markers count for it."""
    take = markers(MESH, performance(NAMES), as_people=True)
    shot = result(take, mesh=with_one_blink(MESH))
    face = shot.shot.face
    assert shot.solution is not None
    apertures = lid_apertures_of(face, face.shape_names)
    gone = lid_estimate(face, apertures, face.shape_names, shot.solution).gone
    peaks = [int((start + 0.09) * 60) for start in BLINKS]
    np.testing.assert_allclose(gone[peaks], 1.0, atol=0.15)
