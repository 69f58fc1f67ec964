from usdface.closure.closed_eyes import CompletedClosing
from usdface.closure.eye_closing import EyeClosing
from usdface.shot.report import _closing


def test_a_gap_that_rounds_to_zero_has_no_sign() -> None:
    blink = EyeClosing("blink", (0, 1), 0.1, 0.2, 0.2, 0.3, 1.0)
    closed = CompletedClosing(blink, (3, 9), 6, (0.5, 0.5), (0.9, 0.9), (-1e-8, 0.0012))
    assert str(_closing(closed)["gap_mm"]) == "[0.0, 1.2]"
