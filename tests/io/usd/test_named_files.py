"""Files as a stage names them, and the places where USD would look first."""

import os
from pathlib import Path

import pytest
from pxr import Sdf

from usdface.io.usd.named_files import named_files


def layer(path: Path, *below: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    made = Sdf.Layer.CreateAnonymous(".usda")
    made.subLayerPaths = list(below)
    made.Export(str(path))
    return path


def test_links_are_named_and_missing_files_too(tmp_path: Path) -> None:
    layer(tmp_path / "take_v1.usda")
    (tmp_path / "take.usda").symlink_to("take_v1.usda")
    shot = layer(tmp_path / "shot.usda", "./take.usda", "./none.usda")
    assert named_files(shot) == ([shot, tmp_path / "take.usda"], [tmp_path / "none.usda"])


def test_places_before_a_file_of_the_search_path_are_missing_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = layer(tmp_path / "second/rig.usda")
    shot = layer(tmp_path / "shots/shot.usda", "rig.usda")
    folders = [str(tmp_path / "first"), str(tmp_path / "second")]
    monkeypatch.setenv("PXR_AR_DEFAULT_SEARCH_PATH", os.pathsep.join(folders))
    from usdface.io.usd.named_files import _searched_before

    earlier = _searched_before([shot, rig])
    assert earlier == [tmp_path / "first/rig.usda", tmp_path / "shots/rig.usda"]
    layer(tmp_path / "first/rig.usda")
    assert _searched_before([shot, rig]) == [tmp_path / "shots/rig.usda"]
