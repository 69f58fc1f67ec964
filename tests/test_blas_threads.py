import inspect
import os
import subprocess
import sys
import threading
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  (loads its own BLAS)
from threadpoolctl import ThreadpoolController

from usdface import assemble_shot, blas_threads, pipeline, retarget, retarget_take
from usdface.blas_threads import BLAS_THREADS, limit_from_start, one_blas_thread
from usdface.retarget.solver.backend import on_all_cores

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
CONTROLS = ThreadpoolController().select(user_api="blas")
RUN = """
import os, sys
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv[2])])
{}
"""
COMMAND = "from usdface.cli import main; sys.exit(main(['process', sys.argv[1]]))"
PYTHON = "import numpy; from usdface import process; process(sys.argv[1])"
RETARGET_TAKE = [
    getattr(module, name)
    for each in iter_modules(retarget_take.__path__)
    for module in [import_module(f"usdface.retarget_take.{each.name}")]
    for name in module.__all__
]


def now() -> list[int]:
    return [library.num_threads for library in CONTROLS.lib_controllers]


@pytest.fixture(autouse=True)
def host() -> object:
    """A host that has set two threads for each library."""
    assert CONTROLS.lib_controllers
    with CONTROLS.limit(limits=2):
        yield now()


def test_within_a_block_there_is_one_thread_and_then_what_the_host_had(host: list[int]) -> None:
    with one_blas_thread():
        assert set(now()) == {1}
        with one_blas_thread():
            assert set(now()) == {1}
        assert set(now()) == {1}
    assert now() == host and set(host) == {2}


def test_an_exception_brings_the_hosts_setting_back(host: list[int]) -> None:
    @one_blas_thread()
    def fail() -> None:
        assert set(now()) == {1}
        raise ValueError

    with pytest.raises(ValueError):
        fail()
    assert now() == host


def test_where_the_libraries_cannot_be_looked_for_nothing_is_left_limited(
    monkeypatch: pytest.MonkeyPatch, host: list[int]
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr(blas_threads, "_loaded", frozenset())
        broken.setitem(sys.modules, "threadpoolctl", None)
        with pytest.raises(ImportError), one_blas_thread():
            pass
    assert blas_threads._inside == 0
    with one_blas_thread():
        assert set(now()) == {1}
    assert now() == host


def test_the_last_of_several_threads_brings_it_back(host: list[int]) -> None:
    """The first goes out while the second is inside: it must not undo the second's limit."""
    first_out, second_in = threading.Event(), threading.Event()
    seen = []

    def second() -> None:
        with one_blas_thread():
            second_in.set()
            first_out.wait(10)
            seen.append(set(now()))

    thread = threading.Thread(target=second)
    with one_blas_thread():
        thread.start()
        second_in.wait(10)
    first_out.set()
    thread.join()
    assert seen == [{1}] and now() == host


def test_a_thread_of_the_host_is_limited_though_another_set_the_library_first(
    host: list[int],
) -> None:
    CONTROLS.lib_controllers[0].set_num_threads(2)
    seen = []

    def compute() -> None:
        with one_blas_thread():
            seen.append(set(now()))

    thread = threading.Thread(target=compute)
    thread.start()
    thread.join()
    assert seen == [{1}] and now() == host


def test_a_library_that_is_loaded_inside_is_limited_by_the_next_block(
    monkeypatch: pytest.MonkeyPatch, host: list[int]
) -> None:
    monkeypatch.setattr(blas_threads, "_LOADERS", ("numpy", "late"))
    with one_blas_thread():
        CONTROLS.lib_controllers[0].set_num_threads(2)
        path = CONTROLS.lib_controllers[0].filepath
        blas_threads._before.pop(path), blas_threads._found.pop(path)
        monkeypatch.setitem(sys.modules, "late", np)
        with one_blas_thread():
            assert set(now()) == {1}
    assert now() == host


def test_our_own_threads_are_limited_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that counts by thread, as OpenBLAS with OpenMP does."""
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    threads = threading.local()
    gate = threading.Barrier(3)

    class Library:
        def set_num_threads(self, count: int) -> None:
            threads.count = count

    seen: list[int] = []

    def work(item: int) -> None:
        gate.wait(10)
        seen.append(getattr(threads, "count", 64))

    with one_blas_thread():
        monkeypatch.setitem(blas_threads._found, "by thread", Library())
        blas_threads._before["by thread"] = 64
        on_all_cores(work, range(3))
    assert seen == [1, 1, 1]


@pytest.mark.parametrize(
    "function",
    [
        getattr(pipeline, name)
        for name in pipeline.__all__
        if not name.startswith(("read_", "list_"))
    ]
    + RETARGET_TAKE
    + [retarget, assemble_shot],
    ids=lambda function: f"{function.__module__}.{function.__name__}",
)
def test_wherever_the_core_is_called_from_it_is_limited(function: object) -> None:
    """Each is decorated: with arguments that fit none of them, it fails inside."""
    assert inspect.unwrap(function) is not function, "decorate it with @one_blas_thread()"


def test_what_the_environment_says_goes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *others = BLAS_THREADS
    monkeypatch.setenv(first, "3")
    for name in others:
        monkeypatch.delenv(name, raising=False)
    limit_from_start()
    assert [os.environ[name] for name in BLAS_THREADS] == ["3", "1", "1"]


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity") or len(os.sched_getaffinity(0)) < 2,
    reason="needs two cores and a system that gives a process less",
)
def test_bytes_do_not_depend_on_the_number_of_cores_nor_on_the_door(tmp_path: Path) -> None:
    shot = tmp_path / "shot.usda"
    for name in ("head.usdc", "take.usdc", "shot.usda"):
        (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
    free = {name: value for name, value in os.environ.items() if name not in BLAS_THREADS}
    free.pop("OMP_NUM_THREADS", None)
    written = []
    for code, cores in ((COMMAND, "1"), (COMMAND, "2"), (PYTHON, "2")):
        words = [sys.executable, "-c", RUN.format(code), str(shot), cores]
        subprocess.run(words, env=free, check=True, capture_output=True)
        layers = (tmp_path / "shot.usdface").iterdir()
        written.append({layer.name: layer.read_bytes() for layer in layers})
    assert written[0].keys() == {"solve.usdc", "express.usdc", "closure.usdc"}
    assert written[0] == written[1] == written[2]
