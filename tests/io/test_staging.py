"""Runs that are killed between any two of their moves, and runs at the same time."""

import json
import os
import shutil
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from usdface.errors import OutputError
from usdface.io import staging
from usdface.io.atomic import (
    all_or_none,
    remove_when_written,
    staged_files,
    write_bridge,
    write_text,
)
from usdface.io.staging import Staging, finish_dead_runs

FILES = ("root", "layers/a", "layers/b", "other/picture")


def write_result(folder: Path, text: str) -> None:
    """Write a root that names two layers, a picture in another folder, and remove a layer."""
    with all_or_none():
        write_text(folder / "other/picture", text)
        for name in ("a", "b"):
            write_text(folder / "layers" / name, text)
        write_text(folder / "root", f"{text}\nlayers/a\nlayers/b")
        with write_bridge(folder / "root") as bridge:
            named = [os.path.relpath(staged_files()[folder / f"layers/{n}"], folder) for n in "ab"]
            bridge.write_text("\n".join([text, *named]))
        remove_when_written(folder / "layers/c")


def opened(folder: Path) -> set[str]:
    """What the root says, and what those files say that it names."""
    text, *named = (folder / "root").read_text().split("\n")
    return {text, *((folder / name).read_text() for name in named)}


def killed_at(number: int, job: Callable[[], object]) -> bool:
    """Run a job in a process that ends without a word at its n-th move; say if it did."""
    child = os.fork()
    if child == 0:
        left = number

        def ends(act: Callable[..., object]) -> Callable[..., object]:
            def moved(*given: object, **named: object) -> object:
                nonlocal left
                left -= 1
                if left < 0:
                    os._exit(9)
                return act(*given, **named)

            return moved

        for name in ("replace", "unlink"):
            setattr(Path, name, ends(getattr(Path, name)))
        os.link, shutil.rmtree = ends(os.link), ends(shutil.rmtree)  # type: ignore[assignment]
        os.open = ends(os.open)  # type: ignore[assignment]
        try:
            job()
        finally:
            os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9


def listed(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_a_kill_at_any_moment_leaves_one_generation(tmp_path: Path) -> None:
    seen, number = set(), 0
    while True:
        folder = tmp_path / str(number)
        write_result(folder, "old")
        (folder / "layers/c").write_text("old")
        if not killed_at(number, lambda folder=folder: write_result(folder, "new")):  # type: ignore[misc]
            break
        assert len(opened(folder)) == 1, number
        for place in ("other", "", "layers"):  # readers come by in any order
            finish_dead_runs(folder / place)
            assert len(opened(folder)) == 1, number
        texts = {(folder / name).read_text().split("\n")[0] for name in FILES}
        assert len(texts) == 1, number
        assert listed(folder) == {*FILES, *(["layers/c"] if texts == {"old"} else [])}
        seen |= texts
        number += 1
    assert seen == {"old", "new"} and number > 20
    assert opened(folder) == {"new"} and listed(folder) == set(FILES)


@pytest.mark.slow
def test_a_killed_repair_is_repaired(tmp_path: Path) -> None:
    for first in range(16, 32, 5):
        for second in range(0, 30, 4):
            folder = tmp_path / f"{first}-{second}"
            write_result(folder, "old")
            assert killed_at(first, lambda folder=folder: write_result(folder, "new"))  # type: ignore[misc]
            killed_at(second, lambda folder=folder: finish_dead_runs(folder))  # type: ignore[misc]
            assert len(opened(folder)) == 1
            for place in ("layers", "", "other"):
                finish_dead_runs(folder / place)
            texts = {(folder / name).read_text().split("\n")[0] for name in FILES}
            assert len(texts) == 1 and listed(folder) == set(FILES)


def test_the_next_run_sweeps(tmp_path: Path) -> None:
    write_result(tmp_path, "old")
    killed_at(12, lambda: write_result(tmp_path, "new"))
    write_result(tmp_path, "newest")
    assert opened(tmp_path) == {"newest"} and listed(tmp_path) == set(FILES)


def test_a_living_run_keeps_its_files(tmp_path: Path) -> None:
    with all_or_none():
        write_text(tmp_path / "a", "a")
        kept = staged_files()[tmp_path / "a"]
        child = os.fork()
        if child == 0:
            finish_dead_runs(tmp_path)
            os._exit(0)
        os.waitpid(child, 0)
        assert kept.read_text() == "a"
    assert listed(tmp_path) == {"a"}


def test_runs_at_the_same_time_leave_the_result_of_one(tmp_path: Path) -> None:
    folders = [tmp_path / str(n) for n in range(8)]
    for folder in folders:
        texts = [f"run {k}" for k in range(4)]
        runs = [threading.Thread(target=write_result, args=(folder, text)) for text in texts]
        for run in runs:
            run.start()
        for run in runs:
            run.join()
        assert len(opened(folder)) == 1 and listed(folder) == set(FILES)
        assert {(folder / name).read_text().split("\n")[0] for name in FILES} == opened(folder)


def test_a_move_that_fails_undoes_those_before(tmp_path: Path) -> None:
    write_result(tmp_path, "old")
    (tmp_path / "layers/b").unlink()
    with pytest.raises(OutputError, match="cannot write"), all_or_none():
        write_text(tmp_path / "layers/a", "new")
        write_text(tmp_path / "layers/d", "new")
        write_text(tmp_path / "layers/b", "new")
        (tmp_path / "layers/b").mkdir()  # by someone else, meanwhile
    assert (tmp_path / "layers/a").read_text() == "old"
    assert listed(tmp_path / "layers") == {"a"}


@pytest.mark.slow
def test_a_journal_from_elsewhere_does_nothing(tmp_path: Path) -> None:
    number = 0
    while not list((tmp_path / "dead").glob(".usdface-*/journal")):  # that it decides
        shutil.rmtree(tmp_path / "dead", ignore_errors=True)
        number += 1
        assert killed_at(number, lambda: write_result(tmp_path / "dead", "new"))
    shutil.copytree(tmp_path / "dead", tmp_path / "copy")
    (tmp_path / "copy/layers/a").write_text("mine")
    before = {n: (tmp_path / "copy" / n).read_bytes() for n in listed(tmp_path / "copy")}
    for place in ("", "layers", "other"):
        finish_dead_runs(tmp_path / "copy" / place)
    assert {n: (tmp_path / "copy" / n).read_bytes() for n in listed(tmp_path / "copy")} == before


@pytest.mark.parametrize("place", ["../victim", "/victim", "..", "", 3])
def test_a_journal_leads_out_of_its_folder_nowhere(tmp_path: Path, place: object) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "victim").write_text("mine")
    made = Staging(folder)
    (made.path / "1").write_text("evil")
    staging._write_journal(made.path, [made.path], [])
    journal = json.loads((made.path / "journal").read_text())
    journal["steps"] = [[0, "move", "1", place]]
    (made.path / "journal").write_text(json.dumps(journal))
    made._lock.release()
    finish_dead_runs(folder)
    assert (tmp_path / "victim").read_text() == "mine"


def test_links_are_no_staging_folders(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "real/mine").touch()
    (tmp_path / ".usdface-x").symlink_to(tmp_path / "real")
    finish_dead_runs(tmp_path)
    assert (tmp_path / "real/mine").exists()
