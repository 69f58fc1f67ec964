"""What usdface wrote a USD file as: by its marks, else by its layout."""

from pathlib import Path

import numpy as np
import pytest
from processed import process, shoot
from pxr import Sdf, Usd
from worlds import make_world

from usdface.io.usd.file_kind import kind_of_usd
from usdface.io.usd.take_write import write_take
from usdface.pipeline import convert_fuzzy
from usdface.takes import WeightsTake


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world with a file of every kind."""
    place = make_world().write(tmp_path_factory.mktemp("own"))
    shoot(place)
    process(place, "--deliver", place / "face.usdc")
    convert_fuzzy(place / "shot.usda", place / "system.usda")
    weights = WeightsTake(("jawOpen",), np.arange(3) / 30, np.zeros((3, 1)), rate=30.0)
    write_take(weights, place / "weights.usda")
    return place


FILES = {
    "shot.usda": "shot",
    "shot.usdface.usda": "result",
    "shot.usdface/solve.usdc": "layer",
    "face.usdc": "deliverable",
    "take.usda": "take",
    "weights.usda": "take",
    "rig.usda": "rig",
    "system.usda": "fuzzy system",
}


@pytest.mark.parametrize("name", FILES)
def test_each_kind_is_known_and_as_written(folder: Path, name: str) -> None:
    assert kind_of_usd(folder / name) == (FILES[name], "")


@pytest.mark.parametrize("name", ["shot.usda", "shot.usdface.usda", "face.usdc"])
def test_an_edit_shows(folder: Path, name: str) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(Sdf.Layer.FindOrOpen(str(folder / name)))
    layer.comment = "mine"
    edited = folder / f"edited_{name}"
    layer.Export(str(edited))
    assert kind_of_usd(edited) == (FILES[name], "edited")


def test_a_root_layer_of_a_time_without_marks_is_a_result(folder: Path) -> None:
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.TransferContent(Sdf.Layer.FindOrOpen(str(folder / "shot.usdface.usda")))
    root.customLayerData = {}
    root.Export(str(folder / "old.usda"))
    assert kind_of_usd(folder / "old.usda") == ("result", "")
    Sdf.CreatePrimInLayer(root, "/Mine")
    root.Export(str(folder / "own.usda"))
    assert kind_of_usd(folder / "own.usda") == ("", "")


def test_an_unsigned_root_layer_may_hold_edits_if_more_than_ours_is_in_it(folder: Path) -> None:
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.TransferContent(Sdf.Layer.FindOrOpen(str(folder / "shot.usdface.usda")))
    marks = {"usdface": {"generation": root.customLayerData["usdface"]["generation"]}}
    old, ours = folder / "older.usda", list(root.subLayerPaths)

    def found(layers: list[str], marks: dict[str, object] = marks) -> tuple[str, str]:
        root.subLayerPaths, root.customLayerData = layers, marks
        root.Export(str(old))
        return kind_of_usd(old)

    assert found(ours) == found(ours, {}) == ("result", "")
    assert found(["./mine.usda", *ours]) == found([*ours, "./mine.usda"]) == ("result", "unsigned")
    assert found([*ours, "./mine.usda"], {}) == ("result", "unsigned")
    Sdf.CreatePrimInLayer(root, "/Mine").specifier = Sdf.SpecifierOver
    assert found(ours) == ("result", "unsigned")


def test_a_deliverable_of_a_time_without_fingerprints_is_told_by_its_layout(folder: Path) -> None:
    layer, old = Sdf.Layer.CreateAnonymous(".usda"), folder / "old_face.usda"
    layer.TransferContent(Sdf.Layer.FindOrOpen(str(folder / "face.usdc")))
    layer.customLayerData = {}
    layer.Export(str(old))
    assert kind_of_usd(old) == ("deliverable", "unsigned")
    Sdf.CreatePrimInLayer(layer, "/Mine")
    layer.Export(str(old))
    assert kind_of_usd(old) == ("", "")


def test_a_file_is_read_anew_while_a_stage_holds_it(folder: Path, tmp_path: Path) -> None:
    shot = tmp_path / "held.usda"
    shot.write_bytes((folder / "shot.usda").read_bytes())
    stage = Usd.Stage.Open(str(shot))
    assert kind_of_usd(shot) == ("shot", "")
    shot.write_text(f'{shot.read_text()}\nover "Mine" {{}}\n')
    assert not stage.GetPrimAtPath("/Mine")
    assert kind_of_usd(shot) == ("shot", "edited")


def test_changes_that_are_not_saved_are_an_edit(folder: Path, tmp_path: Path) -> None:
    shot = tmp_path / "open.usda"
    shot.write_bytes((folder / "shot.usda").read_bytes())
    stage = Usd.Stage.Open(str(shot))
    stage.GetRootLayer().comment = "mine"
    assert kind_of_usd(shot) == ("shot", "edited")


def test_what_others_made_is_of_no_kind(tmp_path: Path) -> None:
    texts = {
        "empty.usda": "#usda 1.0\n",
        "pins.usda": "#usda 1.0\n(subLayers = [@./shot.usda@])\n",
        "broken.usda": "notes",
        "notes.txt": "notes",
        "data.usda": '#usda 1.0\n(customLayerData = {string usdface = "x"})\n',
        "asset.usda": '#usda 1.0\n(defaultPrim = "Asset")\ndef Xform "Asset" {}\n',
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        assert kind_of_usd(tmp_path / name) == ("", ""), name
    stage = Usd.Stage.CreateNew(str(tmp_path / "curves.usda"))  # an animator's own
    stage.SetDefaultPrim(stage.DefinePrim("/Anim", "SkelAnimation"))
    stage.Save()
    assert kind_of_usd(tmp_path / "curves.usda") == ("", "")
