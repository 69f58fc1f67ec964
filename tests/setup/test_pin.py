import numpy as np
import pytest

from usdface.errors import InputError
from usdface.setup.pin import Pin


@pytest.mark.parametrize(
    ("frames", "weights", "expected"),
    [
        ([3, 4], [1.0], "1 weights at 2 frames"),
        ([], [], "at least one"),
        ([4, 3], [1.0, 1.0], "do not rise"),
        ([-1], [1.0], "do not rise from 0"),
        ([3], [1.1], "outside 0 to 1"),
    ],
)
def test_a_pin_has_rising_frames_and_a_weight_for_each(
    frames: list[int], weights: list[float], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        Pin("jawOpen", np.array(frames), np.array(weights))
