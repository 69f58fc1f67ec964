import sys
import threading

import pytest

from usdface.retarget import backend as fast


def test_small_problems_do_not_load_numba() -> None:
    assert fast.kernels(1000, 10) is None


def test_without_numba_there_are_no_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.delitem(sys.modules, "usdface.retarget.kernels", raising=False)
    assert fast.kernels(10**9, 10) is None


def test_where_machine_code_cannot_be_kept_there_are_no_kernels(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def nowhere(name: str) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(fast.importlib, "import_module", nowhere)
    assert fast.kernels(10**9, 10) is None


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
