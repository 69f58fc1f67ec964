import pytest

from usdface.progress import Progress, Step


def test_the_time_of_a_step_within_a_step_is_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 6.0, 8.0])
    monkeypatch.setattr("usdface.progress.time.perf_counter", lambda: next(clock))
    announced: list[Step] = []
    progress = Progress(announced.append)
    with progress.step("solve"), progress.step("compile"):
        pass
    assert [step.name for step in announced] == ["solve", "compile", "solve"]
    assert progress.seconds == {"compile": 5.0, "solve": 3.0}


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
