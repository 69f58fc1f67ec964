import pytest

from usdface.progress import Progress, Step


def test_steps_are_announced_and_timed_also_when_they_fail() -> None:
    announced: list[Step] = []
    steps = Progress(announced.append)
    with steps.step("read"):
        pass
    with pytest.raises(KeyError), steps.step("solve"):
        raise KeyError
    with steps.step("read"):
        pass
    assert [step.name for step in announced] == ["read", "solve", "read"]
    assert list(steps.seconds) == ["read", "solve"] and min(steps.seconds.values()) >= 0
