"""A shot that a person has edited is not overwritten unless told to."""

from pathlib import Path

import pytest
from pxr import Sdf, Usd
from worlds import make_world

import usdface
from usdface.errors import OutputError
from usdface.io.usd.fingerprint import check_unedited, is_unedited, sign


def make(folder: Path, name: str = "shot.usda", overwrite: bool = False) -> Path:
    files = {
        n: folder / f"{n}.{'json' if n == 'bind' else 'usda'}" for n in ("rig", "take", "bind")
    }
    usdface.make_shot(
        files["rig"], files["take"], folder / name, bind=files["bind"], overwrite=overwrite
    )
    return folder / name


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_world().write(tmp_path)


@pytest.mark.parametrize("name", ["shot.usda", "shot.usdc"])
def test_what_nobody_edited_is_replaced(folder: Path, name: str) -> None:
    first = make(folder, name).read_bytes()
    assert make(folder, name).read_bytes() == first


def test_what_somebody_edited_is_kept(folder: Path) -> None:
    shot = make(folder)
    stage = Usd.Stage.Open(str(shot))
    stage.GetPrimAtPath("/Shot/Fuzzy").GetAttribute("usdface:gain").Set(0.6)
    stage.Save()
    edited = shot.read_bytes()
    with pytest.raises(OutputError, match="--overwrite"):
        make(folder)
    assert shot.read_bytes() == edited
    make(folder, overwrite=True)
    assert shot.read_bytes() != edited
    check_unedited(shot)


def test_files_of_another_origin_are_kept(folder: Path) -> None:
    for name, text in (("a.usda", "#usda 1.0\n"), ("b.usda", "notes"), ("c.txt", "notes")):
        (folder / name).write_text(text)
        with pytest.raises(OutputError, match="another origin"):
            check_unedited(folder / name)
    check_unedited(folder / "none.usda")


@pytest.mark.slow
def test_layers_in_place_are_no_edit(folder: Path) -> None:
    shot = make(folder)
    usdface.process(shot, in_place=True)
    check_unedited(shot)
    usdface.process(shot, in_place=True)
    make(folder)


def test_a_fingerprint_leaves_other_data(tmp_path: Path) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.customLayerData = {"usdface": {"mine": 1}, "studio": "x"}
    assert not is_unedited(layer)
    sign(layer)
    assert is_unedited(layer)
    assert layer.customLayerData["usdface"]["mine"] == 1
    layer.customLayerData = {**layer.customLayerData, "studio": "y"}
    assert not is_unedited(layer)
