import numpy as np
import pytest

from usdface.errors import InputError
from usdface.takes import WeightsTake

RNG = np.random.default_rng(3)


def weights(**changes: object) -> WeightsTake:
    given = {"names": ("a", "b"), "times": np.arange(4) / 30, "weights": RNG.random((4, 2))}
    return WeightsTake(**(given | changes))  # type: ignore[arg-type]


def test_a_take_cannot_be_changed() -> None:
    take = weights()
    for array in (take.weights, take.times):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(AttributeError):
        take.rate = 24.0  # type: ignore[misc]


def test_columns_travel_by_name() -> None:
    take = weights()
    np.testing.assert_array_equal(take.column("b"), take.weights[:, 1])
    again = take.reordered(("x", "b", "a"))
    assert again.names == ("x", "b", "a")
    np.testing.assert_array_equal(again.weights[:, 1:], take.weights[:, ::-1])
    assert (again.column("x") == 0).all()
    np.testing.assert_array_equal(again.reordered(take.names).weights, take.weights)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"names": ("a",)}, "expected (frames, 1)"),
        ({"names": ("a", "a")}, "'a' occurs twice"),
        ({"weights": np.zeros((0, 2)), "times": []}, "no frames"),
        ({"weights": np.full((4, 2), np.nan)}, "finite"),
        ({"times": [3.0, 2.0, 1.0, 0.0]}, "increasing"),
    ],
)
def test_weights_that_make_no_take(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        weights(**changes)
    assert message in str(caught.value)
