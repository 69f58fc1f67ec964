"""A shot that a person has edited is not overwritten unless told to."""

from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, Vt
from worlds import make_world

import usdface
from usdface.errors import OutputError
from usdface.io.usd.conversion_metadata import write_layer_metadata
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


def test_a_text_in_the_place_of_our_data_gives_way() -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.customLayerData = {"usdface": "by hand", "studio": "x"}
    write_layer_metadata(layer, "mine", 1)
    assert layer.customLayerData == {"usdface": {"mine": 1}, "studio": "x"}


def a_take() -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    prim = Sdf.CreatePrimInLayer(layer, "/Face")
    kinds = Sdf.ValueTypeNames
    samples = {
        "weights": (kinds.FloatArray, Vt.FloatArray([0.1, 1e-9])),
        "names": (kinds.TokenArray, Vt.TokenArray(["a", "b"])),
        "turns": (kinds.QuatfArray, Vt.QuatfArray([Gf.Quatf(1, 0, 0.5, 0)])),
        "sizes": (kinds.Half3Array, Vt.Vec3hArray([Gf.Vec3h(1, 2, 3)])),
        "place": (kinds.Matrix4d, Gf.Matrix4d(2)),
        "residual": (kinds.Float, 0.3),
    }
    for name, (kind, value) in samples.items():
        path = Sdf.AttributeSpec(prim, name, kind).path
        for code in (0.0, 1.5, 2.0):
            layer.SetTimeSample(path, code, value)
    layer.SetTimeSample("/Face.residual", 3.0, Sdf.ValueBlock())
    return layer


def test_samples_are_those_that_were_written(tmp_path: Path) -> None:
    layer = a_take()
    sign(layer, take=True)
    assert is_unedited(layer)
    for suffix in (".usda", ".usdc"):
        layer.Export(str(tmp_path / f"take{suffix}"))
        assert is_unedited(Sdf.Layer.OpenAsAnonymous(str(tmp_path / f"take{suffix}")))


@pytest.mark.parametrize(
    ("path", "code", "value"),
    [
        ("/Face.weights", 1.5, Vt.FloatArray([0.1, 2e-9])),
        ("/Face.weights", 1.6, Vt.FloatArray([0.1, 1e-9])),
        ("/Face.names", 0.0, Vt.TokenArray(["b", "a"])),
        ("/Face.turns", 2.0, Vt.QuatfArray([Gf.Quatf(1, 0, 0.5001, 0)])),
        ("/Face.sizes", 0.0, Vt.Vec3hArray([Gf.Vec3h(1, 2, 4)])),
        ("/Face.place", 0.0, Gf.Matrix4d(3)),
        ("/Face.residual", 1.5, Sdf.ValueBlock()),
    ],
)
def test_one_sample_that_differs_is_an_edit(path: str, code: float, value: object) -> None:
    layer = a_take()
    sign(layer, take=True)
    layer.SetTimeSample(path, code, value)
    assert is_signed(layer) and not is_unedited(layer)


def test_what_is_no_sample_counts_too() -> None:
    layer = a_take()
    sign(layer, take=True)
    layer.GetPrimAtPath("/Face").SetInfo("comment", "mine")
    assert not is_unedited(layer)
    layer.GetPrimAtPath("/Face").ClearInfo("comment")
    assert is_unedited(layer)
    layer.GetAttributeAtPath("/Face.residual").default = 1.0
    assert not is_unedited(layer)
