import numpy as np
import pytest

from usdface.binding.marker_names import named_heights


def test_names_say_what_is_above_what() -> None:
    names = ("ForeHead_M", "Reye_Up", "browOut", "LIP_LOW", "chin.1", "nosetip", "x")
    heights = named_heights(names)
    order = np.argsort(heights[:-1])
    assert [names[i] for i in order] == [
        "chin.1", "LIP_LOW", "nosetip", "Reye_Up", "browOut", "ForeHead_M",
    ]  # fmt: skip
    assert np.isnan(heights[-1])


@pytest.mark.parametrize(
    "names", [("m1", "m2"), ("nose", "chin", "m3"), tuple(f"lip{i}" for i in range(9))]
)
def test_few_names_say_nothing(names: tuple[str, ...]) -> None:
    assert np.isnan(named_heights(names)).all()
