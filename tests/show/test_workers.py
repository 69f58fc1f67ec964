"""Workers that die or hang fail their task alone."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from usdface.show.workers import run_in_workers


def run(tasks: list[str], workers: int = 1, time_limit: float = 60.0) -> dict[int, object]:
    done = run_in_workers("show_tasks:work", tasks, workers=workers, time_limit=time_limit)
    return {outcome.number: outcome for outcome in done}


def test_values_errors_and_faults_come_back_with_their_task(
    capfd: pytest.CaptureFixture[str],
) -> None:
    outcomes = run(["one", "refuse", "print", "fault", "two"])
    assert [outcomes[k].value for k in range(5)] == ["one", None, "print", None, "two"]
    assert (outcomes[1].code, outcomes[1].error) == ("FACE_MISSING", "no such face")
    assert (outcomes[3].code, outcomes[3].error) == (
        "PROGRAM_FAULT",
        "ZeroDivisionError: by nothing",
    )
    printed = capfd.readouterr()
    assert printed.out == "" and "words of a library" in printed.err


def test_a_worker_lives_as_long_as_there_is_work() -> None:
    outcomes = run(["who"] * 6, workers=2)
    members = Counter(outcome.value for outcome in outcomes.values())
    assert len(members) <= 2 and os.getpid() not in members


@pytest.mark.slow
def test_a_dead_or_hanging_worker_is_replaced_and_the_others_go_on() -> None:
    begun: list[int] = []
    tasks = ["die", "one", "exit", "hang", "two"]
    done = run_in_workers(
        "show_tasks:work", tasks, workers=2, time_limit=3.0, on_begin=begun.append
    )
    outcomes = {outcome.number: outcome for outcome in done}
    assert begun == [0, 1, 2, 3, 4]
    assert outcomes[1].value == "one" and outcomes[4].value == "two"
    assert outcomes[0].code == outcomes[2].code == "WORKER_DIED"
    assert "SIGKILL" in outcomes[0].error and "status 7" in outcomes[2].error
    assert outcomes[3].code == "WORKER_HUNG" and "--time-limit" in outcomes[3].error


def test_workers_end_when_the_caller_stops_listening() -> None:
    outcomes = run_in_workers("show_tasks:work", ["who", "hang"], workers=1, time_limit=60.0)
    worker = next(outcomes).value
    outcomes.close()
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)


@pytest.mark.parametrize("piped", [True, False])
def test_a_script_without_a_main_guard_is_run_once(piped: bool, tmp_path: Path) -> None:
    """Also one that is no file, as in a notebook."""
    script = tmp_path / "script.py"
    script.write_text(
        "print('begun')\n"
        "from usdface.show.workers import run_in_workers\n"
        "tasks = [['a', 'b'], ['c']]\n"
        "done = run_in_workers('builtins:len', tasks, workers=2, time_limit=60.0)\n"
        "print(sorted(outcome.value for outcome in done))\n"
    )
    command = [sys.executable, *([] if piped else [str(script)])]
    given = script.read_text() if piped else None
    ended = subprocess.run(command, input=given, capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ("begun\n[1, 2]\n", "")
