import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from usdface.progress import COMPILE, Progress, Step
from usdface.retarget.solver import backend as fast


def test_small_problems_do_not_load_numba() -> None:
    assert fast.kernels(1000, 10) is None


def test_without_numba_there_are_no_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    for name in [name for name in sys.modules if ".solver.kernels" in name]:
        monkeypatch.delitem(sys.modules, name)
    assert fast.kernels(10**9, 10) is None


def test_where_machine_code_cannot_be_kept_there_are_no_kernels(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def nowhere(name: str) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(fast.importlib, "import_module", nowhere)
    assert fast.kernels(10**9, 10) is None


def announced(frames: int, size: int) -> tuple[list[str], list[str]]:
    """The steps that are announced within the solve, and the codes of what is found."""
    steps: list[Step] = []
    progress = Progress(steps.append)
    with progress.step("solve"):
        found = fast.compile_kernels(frames, size, progress)
    return [step.name for step in steps], [f.code for f in found]


def test_compiling_is_a_step_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    event = pytest.importorskip("numba.core.event")

    def compiled(*_: int) -> object:
        for _ in range(3):
            with event.trigger_event("numba:compile", data={}):
                pass
        return object()

    monkeypatch.setattr(fast, "kernels", compiled)
    assert announced(10**9, 10) == (["solve", COMPILE, "solve"], [])


def test_machine_code_that_is_there_is_no_step(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    monkeypatch.setattr(fast, "kernels", lambda *_: object())
    assert announced(10**9, 10) == (["solve"], [])


def test_small_problems_ask_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba.core", None)
    assert announced(1000, 10) == (["solve"], [])


def test_without_numba_only_a_long_solve_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setitem(sys.modules, "numba.core", None)
    assert announced(4000, 53) == (["solve"], [])
    assert announced(40_000, 53) == (["solve"], ["SOLVE_UNCOMPILED"])


def test_without_a_place_for_machine_code_the_way_out_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("numba")
    monkeypatch.setattr(fast, "kernels", lambda *_: None)
    (found,) = fast.compile_kernels(40_000, 53, Progress())
    assert found.code == "SOLVE_UNCOMPILED" and "NUMBA_CACHE_DIR" in found.message


@pytest.mark.slow
def test_a_first_solve_says_that_it_compiles_and_the_second_does_not(tmp_path: Path) -> None:
    pytest.importorskip("numba")
    code = (
        "from usdface.progress import Progress; from usdface.retarget.solver import backend\n"
        "progress = Progress(lambda step: print(step.name))\n"
        "backend.compile_kernels(10**9, 10, progress); print('done')"
    )
    there = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    there.pop("NUMBA_CACHE_DIR", None)
    printed = [
        subprocess.run(
            [sys.executable, "-c", code], env=there, check=True, capture_output=True, text=True
        ).stdout.split("\n")
        for _ in range(2)
    ]
    assert printed == [[COMPILE, "done", ""], ["done", ""]]
    assert list(tmp_path.glob("usdface/compiled/*/*.nbc"))


@pytest.mark.parametrize("cores", [1, 4])
def test_every_item_is_done_once_and_errors_come_out(
    monkeypatch: pytest.MonkeyPatch, cores: int
) -> None:
    monkeypatch.setattr(fast.os, "cpu_count", lambda: cores)
    done: list[int] = []
    lock = threading.Lock()

    def note(item: int) -> None:
        with lock:
            done.append(item)

    fast.on_all_cores(note, range(20))
    assert sorted(done) == list(range(20))

    def fail(item: int) -> None:
        raise ValueError(item)

    with pytest.raises(ValueError, match="7"):
        fast.on_all_cores(fail, [7, 8])
