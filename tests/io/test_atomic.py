import os
from pathlib import Path

import pytest

from usdface.errors import OutputError
from usdface.io.atomic import (
    all_or_none,
    atomic_path,
    check_place,
    when_written,
    write_bytes,
    write_text,
)


def test_the_file_is_there_and_nothing_else(tmp_path: Path) -> None:
    write_text(tmp_path / "new" / "a.txt", "grün")
    assert (tmp_path / "new" / "a.txt").read_text(encoding="utf-8") == "grün"
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["a.txt"]


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(ValueError, match="half"), atomic_path(path) as temporary:
        temporary.write_text("new, but only ha")
        raise ValueError("half")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_no_new_folder(tmp_path: Path) -> None:
    path = tmp_path / "new" / "deep" / "a.txt"
    with pytest.raises(ValueError, match="half"), atomic_path(path):
        raise ValueError("half")
    with pytest.raises(OutputError, match="File name too long"):
        write_text(path.with_name(300 * "a"), "text")
    assert list(tmp_path.iterdir()) == []


def test_results_are_as_readable_as_any_new_file(tmp_path: Path) -> None:
    ordinary = tmp_path / "ordinary"
    ordinary.touch()
    write_bytes(tmp_path / "ours", b"1")
    assert (tmp_path / "ours").stat().st_mode == ordinary.stat().st_mode


@pytest.mark.parametrize("name", ["file/inside.txt", "folder"])
def test_a_place_that_cannot_be_written_is_one_clear_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match="cannot write") as caught:
        write_text(tmp_path / name, "text")
    assert "\n" not in str(caught.value) and name.split("/")[0] in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_a_place_is_looked_at_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").touch()
    for name, reason in (
        (300 * "a", "File name too long"),
        (f"{300 * 'a'}/a.txt", "File name too long"),
        ("loop/a.txt", "symbolic links"),
        ("file/a.txt", "is no folder"),
    ):
        with pytest.raises(OutputError, match=f"cannot write .*{reason}.*; choose a place"):
            check_place(tmp_path / name)
    check_place(tmp_path / "new" / "a.txt")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may enter any folder")
def test_a_place_in_a_folder_that_may_not_be_entered(tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o600)
    with pytest.raises(OutputError, match=r"cannot write .*Permission denied"):
        check_place(tmp_path / "locked" / "a.txt")


def test_several_files_are_written_or_none(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "new" / "second"
    first.write_text("old")
    with pytest.raises(OutputError, match="File name too long"), all_or_none():
        write_text(first, "new")
        write_text(second, "new")
        write_text(tmp_path / (300 * "a"), "new")
    assert first.read_text() == "old" and list(tmp_path.iterdir()) == [first]
    with all_or_none():
        write_text(first, "new")
        with all_or_none():
            write_text(second, "new")
        assert first.read_text() == "old" and not second.exists()
    assert first.read_text() == second.read_text() == "new"
    assert len([p for p in tmp_path.rglob("*") if p.is_file()]) == 2


def test_one_of_several_files_may_fail(tmp_path: Path) -> None:
    with all_or_none():
        write_text(tmp_path / "a", "a")
        with pytest.raises(ValueError, match="half"), atomic_path(tmp_path / "b") as temporary:
            temporary.write_text("ha")
            raise ValueError("half")
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_actions_wait_for_the_files(tmp_path: Path) -> None:
    seen: list[bool] = []
    with all_or_none():
        write_text(tmp_path / "a", "a")
        when_written(lambda: seen.append((tmp_path / "a").exists()))
        assert seen == []
    when_written(lambda: seen.append(False))
    assert seen == [True, False]
