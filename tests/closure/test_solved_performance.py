import numpy as np
from marker_face import marker_face

from usdface.closure.solved_performance import SolvedPerformance
from usdface.setup.pin import Pin
from usdface.takes import WeightsTake

TIMES = np.arange(5.0)
SOLVED = WeightsTake(("blink", "wide"), TIMES, np.full((5, 2), 0.5))


def test_without_exaggeration_it_is_as_performed() -> None:
    performance = SolvedPerformance.of(marker_face(), SOLVED, None)
    assert performance.performed is SOLVED and not performance.is_exaggerated
    assert not performance.near_pins.any()
    weaker = WeightsTake(SOLVED.names, TIMES, 0.5 * SOLVED.weights)
    assert SolvedPerformance.of(marker_face(), SOLVED, None, (), weaker).is_exaggerated


def test_a_pin_holds_its_own_shape_in_its_frame() -> None:
    pin = Pin("wide", [2.0], [0.3])
    near = SolvedPerformance.of(marker_face(), SOLVED, None, (pin,)).near_pins
    assert near[2].tolist() == [0.0, 1.0] and not near[:, 0].any()
