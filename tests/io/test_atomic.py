from pathlib import Path

import pytest

from usdface.errors import OutputError
from usdface.io.atomic import atomic_path, write_bytes, write_text


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
