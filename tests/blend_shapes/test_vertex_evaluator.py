import pytest
from few_shapes import few_shapes

from usdface.blend_shapes.blend_shape import Combination


@pytest.mark.parametrize(
    "combinations",
    [
        {"c": Combination(("a", "nobody"))},
        {"c": Combination(("a", "c"))},
        {"c": Combination(())},
    ],
)
def test_what_makes_no_sense_is_said_and_solved_as_its_own(combinations) -> None:
    model, found = few_shapes(**combinations)
    assert found == ["COMBINATION_IGNORED c"] and model.linear and len(model.free) == 4


def test_a_ring_is_said() -> None:
    model, found = few_shapes(c=Combination(("a", "d")), d=Combination(("c", "b")))
    assert found == ["COMBINATION_IGNORED c", "COMBINATION_IGNORED d"] and model.linear
