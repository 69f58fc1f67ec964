import numpy as np
from chin_system import chin

from usdface.correction.held_back import held_back_findings


def test_an_emotion_that_a_region_holds_back_is_reported_where_it_is_strong() -> None:
    system = chin("take")
    outputs = np.array([0.1, 0.3, 0.6, 0.8, 0.8, 0.0])[:, None]
    absent = np.array([True, True, True, True, False, True])[:, None]
    missing = {"both": {"brows": absent & False, "mouth": absent}}
    (found,) = held_back_findings(system, {"both": outputs}, missing)  # type: ignore[arg-type]
    assert (found.code, found.where) == ("EXPRESSION_HELD_BACK", system.emotions[0])
    assert "0.80 in 2 frames (2 to 3)" in found.message and "mouth" in found.message
    nowhere = {"both": {"mouth": outputs < 0.0}}
    assert held_back_findings(system, {"both": outputs}, nowhere) == []  # type: ignore[arg-type]
