"""A shot that a person has edited is not overwritten unless told to."""

from pathlib import Path

import pytest
from pxr import Sdf, Usd
from worlds import make_world

import usdface
from usdface.errors import OutputError
from usdface.io.usd.file_kind import kind_of_usd
from usdface.io.usd.fingerprint import is_signed, is_unedited, sign


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
    assert kind_of_usd(shot) == ("shot", "")


@pytest.mark.slow
def test_layers_in_place_are_no_edit(folder: Path) -> None:
    shot = make(folder)
    usdface.process(shot, in_place=True)
    assert kind_of_usd(shot) == ("shot", "")
    usdface.process(shot, in_place=True)
    make(folder)


def test_a_fingerprint_leaves_other_data(tmp_path: Path) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.customLayerData = {"usdface": {"mine": 1}, "studio": "x"}
    assert not is_signed(layer) and not is_unedited(layer)
    sign(layer)
    assert is_signed(layer) and is_unedited(layer)
    assert layer.customLayerData["usdface"]["mine"] == 1
    layer.customLayerData = {**layer.customLayerData, "studio": "y"}
    assert is_signed(layer) and not is_unedited(layer)
