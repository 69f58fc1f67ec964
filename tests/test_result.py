import pytest

from usdface.result import Steps


def test_steps_are_announced_and_timed_also_when_they_fail() -> None:
    heard: list[str] = []
    steps = Steps(heard.append)
    with steps("read"):
        pass
    with pytest.raises(KeyError), steps("solve"):
        raise KeyError
    with steps("read"):
        pass
    assert heard == ["read", "solve", "read"]
    assert list(steps.seconds) == ["read", "solve"] and min(steps.seconds.values()) >= 0
