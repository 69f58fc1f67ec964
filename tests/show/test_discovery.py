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


@pytest.mark.parametrize("name", ["face.glb", "none.txt", "none.toml", "empty"])
def test_no_shots_is_an_error(tmp_path: Path, name: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=name):
        find_shots([tmp_path / name], lambda path: True)
