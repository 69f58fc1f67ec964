import pytest

from usdface.result import Steps


def test_the_time_of_a_step_within_a_step_is_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 6.0, 8.0])
    monkeypatch.setattr("usdface.result.time.perf_counter", lambda: next(clock))
    heard: list[str] = []
    steps = Steps(heard.append)
    with steps("solve"), steps("compile"):
        pass
    assert heard == ["solve", "compile", "solve"]
    assert steps.seconds == {"compile": 5.0, "solve": 3.0}


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
