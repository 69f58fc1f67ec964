import numpy as np
import pytest

from usdface.errors import InputError
from usdface.takes.frame_index import check_frame, frame_at

TIMES = np.arange(10) / 30


def test_a_time_is_the_nearest_frame() -> None:
    assert [frame_at(TIMES, t) for t in (0.0, -0.016, 0.04, 0.31)] == [0, 0, 1, 9]
    with pytest.raises(InputError, match=r"no frame at 0.32 s; the take goes from 0 to 0.3 s"):
        frame_at(TIMES, 0.32)


@pytest.mark.parametrize("index", [-1, 10])
def test_a_frame_that_a_take_does_not_have_is_refused(index: int) -> None:
    check_frame(TIMES, 9)
    with pytest.raises(InputError, match=f"no frame {index}; the take has frames 0 to 9"):
        check_frame(TIMES, index)
