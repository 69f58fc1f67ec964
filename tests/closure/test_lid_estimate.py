"""How much of the opening between the lids is gone, as the blend shapes together explain it."""

import numpy as np
from closing_world import BLINKS, TIMES, markers, performance, result
from slits import slit_face

from usdface.closure.lid_estimate import lid_estimate
from usdface.closure.lid_gaps import lid_gaps_of
from usdface.shot import ShotResult

MESH = slit_face()
NAMES = MESH.shape_names


def estimate_of(shot: ShotResult) -> np.ndarray:
    face = shot.shot.face
    assert shot.solution is not None
    return lid_estimate(face, lid_gaps_of(face, NAMES), NAMES, shot.solution)


def test_all_of_the_opening_is_gone_in_a_blink_and_nothing_at_rest() -> None:
    estimate = estimate_of(result(markers(MESH, performance(NAMES))))
    peaks = [int((start + 0.09) * 60) for start in BLINKS]
    np.testing.assert_allclose(estimate[peaks], 1.0, atol=0.12)
    assert np.abs(estimate[TIMES < 0.9]).max() < 0.05


def test_it_is_in_proportion_and_of_each_eye() -> None:
    weights = performance(NAMES)
    weights[:, NAMES.index("eyeBlinkRight")] = 0.0
    estimate = estimate_of(result(markers(MESH, weights, share=0.5)))
    np.testing.assert_allclose(estimate.max(axis=0), [0.5, 0.0], atol=0.1)


def test_an_eye_without_markers_is_not_seen() -> None:
    estimate = estimate_of(result(markers(MESH, performance(NAMES), without=("eye_right",))))
    assert np.isnan(estimate[:, 1]).all() and np.isfinite(estimate[:, 0]).all()
