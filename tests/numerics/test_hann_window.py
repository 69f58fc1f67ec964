import numpy as np
import pytest

from usdface.numerics.hann_window import hann_average, hann_envelope


def test_an_average_keeps_a_level_and_spreads_a_spike() -> None:
    assert hann_average(np.full(9, 3.0), 4) == pytest.approx(3.0)
    spike = np.eye(9)[4]
    assert hann_average(spike, 4)[2:7] == pytest.approx(np.array([0.25, 0.75, 1.0, 0.75, 0.25]) / 3)


def test_an_envelope_is_nowhere_below() -> None:
    values = np.random.default_rng(5).random((40, 3))
    envelope = hann_envelope(values, 6)
    assert (envelope >= values - 1e-12).all()
    assert np.array_equal(envelope[:, 1], hann_envelope(values[:, 1], 6))


@pytest.mark.parametrize("frames", [0, 1])
def test_a_window_of_one_frame_changes_nothing(frames: int) -> None:
    values = np.random.default_rng(6).random(7)
    assert np.array_equal(hann_envelope(values, frames), values)
