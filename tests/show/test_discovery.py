"""Shots of a folder, a list, or by name."""

from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.show.discovery import find_shots


def test_a_folder_is_searched_and_results_are_no_shots(tmp_path: Path) -> None:
    for name in ("b/x.usda", "a/x.usdc", "rig.usdc", "a/x.usdface.usda", "a/x.usdface/solve.usdc"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    asked = []

    def is_shot(path: Path) -> bool:
        asked.append(path.name)
        return path.name != "rig.usdc"

    plans = find_shots([tmp_path], is_shot)
    assert [plan.name for plan in plans] == ["a/x", "b/x"]
    assert sorted(asked) == ["rig.usdc", "x.usda", "x.usdc"]


def test_a_list_has_a_shot_a_line(tmp_path: Path) -> None:
    (tmp_path / "shots.txt").write_text("# Friday\na.usda\n\nsub/a.usda\na.usda\n")
    plans = find_shots([tmp_path / "shots.txt"], lambda path: True)
    assert [plan.file for plan in plans] == [tmp_path / "a.usda", tmp_path / "sub/a.usda"]
    assert len({plan.name for plan in plans}) == 2
    moved = find_shots([tmp_path / "shots.txt"], lambda path: True, Path("/show"))
    assert moved[0].file == Path("/show/a.usda")


def test_results_beside_their_shots_are_left_out(tmp_path: Path) -> None:
    """As a shell writes `*.usda`; each would be solved again, over itself."""
    files = [tmp_path / f"{name}.usda" for name in ("a", "a.usdface", "b.usdface", "c.v2")]
    plans = find_shots(files, lambda path: True)
    assert [plan.name for plan in plans] == ["a", "b.usdface", "c.v2"]
    listed = tmp_path / "shots.txt"
    listed.write_text("a.usdface.usda\na.usdc\n")
    assert [plan.name for plan in find_shots([listed], lambda path: True)] == ["a"]


@pytest.mark.parametrize("name", ["face.glb", "none.txt", "none.toml", "empty"])
def test_no_shots_is_an_error(tmp_path: Path, name: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=name):
        find_shots([tmp_path / name], lambda path: True)
