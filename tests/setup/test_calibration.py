import numpy as np
import pytest

from usdface.errors import InputError
from usdface.setup.calibration import Calibration


def test_other_blend_shapes_have_gain_1_and_offset_0() -> None:
    calibration = Calibration(("jawOpen", "mouthPucker"), [1.3, 0.8], [0.05, 0.0])
    gains, offsets = calibration.of(("mouthPucker", "browInnerUp", "jawOpen"))
    np.testing.assert_array_equal(gains, [0.8, 1.0, 1.3])
    np.testing.assert_array_equal(offsets, [0.0, 0.0, 0.05])


@pytest.mark.parametrize(
    ("gains", "offsets", "expected"),
    [
        ([1.3], [0.0, 0.0], "1 gains for 2"),
        ([1.3, 1.0], [0.0], "1 offsets for 2"),
        ([1.3, 100.0], [0.0, 0.0], "'b' has 100"),
        ([1.0, 1.0], [-0.1, 0.0], "'a' has -0.1"),
        ([1.0, np.nan], [0.0, 0.0], "'b' has nan"),
    ],
)
def test_each_blend_shape_has_a_gain_and_an_offset_within_limits(
    gains: list[float], offsets: list[float], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        Calibration(("a", "b"), np.array(gains), np.array(offsets))


def test_a_blend_shape_is_calibrated_once() -> None:
    with pytest.raises(InputError, match="twice"):
        Calibration(("a", "a"), np.ones(2), np.zeros(2))
