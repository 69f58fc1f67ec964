"""How far markers show the performer's eyes closed."""

import numpy as np
import pytest
from closing_world import BLINKS, TIMES, markers, performance, result
from slits import slit_face

from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.lid_signal import lid_signal
from usdface.shot.shot import ShotResult

MESH = slit_face()
NAMES = MESH.shape_names


def signal_of(shot: ShotResult) -> np.ndarray:
    face = shot.shot.face
    return lid_signal(face, lid_apertures_of(face, NAMES), shot.solved, shot.solution)


def test_it_is_1_where_the_markers_move_as_the_closed_eye_has_them() -> None:
    signal = signal_of(result(markers(MESH, performance(NAMES), as_people=True)))
    peaks = [int((start + 0.09) * 60) for start in BLINKS]
    np.testing.assert_allclose(signal[peaks], 1.0, atol=0.1)
    assert np.abs(signal[TIMES < 0.9]).max() < 0.05


@pytest.mark.slow
def test_it_is_in_proportion_and_of_each_eye() -> None:
    weights = performance(NAMES)
    weights[:, NAMES.index("eyeBlinkRight")] = 0.0
    signal = signal_of(result(markers(MESH, weights, share=0.5, as_people=True)))
    np.testing.assert_allclose(signal.max(axis=0), [0.5, 0.0], atol=0.1)


@pytest.mark.slow
def test_an_eye_without_markers_is_not_seen() -> None:
    signal = signal_of(result(markers(MESH, performance(NAMES), without=("eye_right",))))
    assert np.isnan(signal[:, 1]).all() and np.isfinite(signal[:, 0]).all()


@pytest.mark.slow
def test_a_take_of_weights_says_it_itself() -> None:
    shot = result(markers(MESH, performance(NAMES)))
    face = shot.shot.face
    signal = lid_signal(face, lid_apertures_of(face, NAMES), shot.solved, None)
    for column, side in enumerate(("Left", "Right")):
        np.testing.assert_array_equal(signal[:, column], shot.solved.column(f"eyeBlink{side}"))
