import numpy as np
import pytest

from usdface.errors import InputError
from usdface.setup.binding import Binding


def test_a_binding_has_one_point_for_each_marker() -> None:
    with pytest.raises(InputError, match="1 points for 2 markers"):
        Binding(("a", "b"), np.array([1]))
    with pytest.raises(InputError, match="twice"):
        Binding(("a", "a"), np.array([1, 2]))


@pytest.mark.parametrize("confidence", [[0.5], [0.5, 1.1], [-0.1, 0.5]])
def test_a_binding_has_a_confidence_from_0_to_1_for_each_marker(confidence: list[float]) -> None:
    with pytest.raises(InputError, match="confidence"):
        Binding(("a", "b"), np.array([1, 2]), confidence=np.array(confidence))


def test_confidences_may_be_unknown() -> None:
    Binding(("a", "b"), np.array([1, 2]), confidence=np.array([np.nan, 1.0]))
