"""A result over an open stage: in the session alone, and gone again without a trace."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from checkout import CHECKOUT, environment
from processed import shoot
from pxr import Sdf, Usd, UsdGeom, UsdShade
from usdface_usdview.preview import Preview, shot_file
from worlds import make_world

from usdface.options import ProcessOptions
from usdface.pipeline import process
from usdface.result import Result
from usdface.shot.shot import ShotResult


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(make_world().write(tmp_path_factory.mktemp("preview")))


@pytest.fixture(scope="module")
def result(shot: Path, tmp_path_factory: pytest.TempPathFactory) -> Result[ShotResult]:
    return process(shot, output=tmp_path_factory.mktemp("result") / "shot.usdface.usda")


def nothing() -> None: ...


def weights(stage: Usd.Stage, names: tuple[str, ...]) -> np.ndarray:
    """The weights that the stage plays, by frame."""
    (prim,) = (p for p in stage.Traverse() if p.GetTypeName() == "SkelAnimation")
    order = [list(prim.GetAttribute("blendShapes").Get()).index(name) for name in names]
    attribute = prim.GetAttribute("blendShapeWeights")
    return np.array([attribute.Get(code) for code in attribute.GetTimeSamples()])[:, order]


def layers(result: Result[ShotResult]) -> list[str]:
    return [str(path) for path in result.written[1:]]


def test_the_stage_plays_the_result_and_then_itself_again(
    shot: Path, result: Result[ShotResult]
) -> None:
    stage = Usd.Stage.Open(str(shot))
    before = stage.Flatten().ExportToString()
    preview = Preview(stage, nothing)
    preview.show(layers(result))
    value = result.value
    np.testing.assert_allclose(
        weights(stage, value.weights.names), value.weights.weights, atol=1e-7
    )
    assert preview.frames == list(range(40))
    preview.mute(["closure", "express"])
    np.testing.assert_allclose(weights(stage, value.solved.names), value.solved.weights, atol=1e-7)
    preview.mute([])
    np.testing.assert_allclose(
        weights(stage, value.weights.names), value.weights.weights, atol=1e-7
    )
    preview.remove()
    assert stage.Flatten().ExportToString() == before
    assert not list(stage.GetSessionLayer().subLayerPaths)


def test_no_layer_of_the_user_is_edited(shot: Path, result: Result[ShotResult]) -> None:
    stage = Usd.Stage.Open(str(shot))
    session = stage.GetSessionLayer()
    preview = Preview(stage, nothing)
    preview.show(layers(result))
    preview.mute(["express"])
    mesh = str(next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)).GetPath())
    count = len(UsdGeom.Mesh(stage.GetPrimAtPath(mesh)).GetPointsAttr().Get())
    preview.paint(mesh, np.ones((count, 3)))
    assert not [each for each in stage.GetUsedLayers() if each.dirty and not each.anonymous]
    assert not session.rootPrims
    assert stage.GetEditTarget().GetLayer() == stage.GetRootLayer()


@pytest.mark.slow
def test_another_result_of_the_same_files_is_read_again(shot: Path, tmp_path: Path) -> None:
    root = tmp_path / "shot.usdface.usda"
    first = process(shot, output=root)
    stage = Usd.Stage.Open(str(shot))
    preview = Preview(stage, nothing)
    preview.show(layers(first))
    second = process(
        shot, output=root, options=ProcessOptions(gains={"joy": 0.0}), solved=first.value
    )
    preview.show(layers(second))
    value = second.value.weights
    np.testing.assert_allclose(weights(stage, value.names), value.weights, atol=1e-7)
    assert np.abs(value.weights - first.value.weights.weights).max() > 0.05


def test_faces_are_inactive_while_the_viewport_is_drawn(
    shot: Path, result: Result[ShotResult]
) -> None:
    """Storm keeps the weights of a face until then."""
    stage = Usd.Stage.Open(str(shot))
    (root,) = (p.GetPath() for p in stage.Traverse() if p.GetTypeName() == "SkelRoot")
    seen = []
    preview = Preview(stage, lambda: seen.append(stage.GetPrimAtPath(root).IsActive()))
    preview.show(layers(result))
    assert seen == [False, False, True]


def test_colours_replace_materials_and_give_them_back(
    shot: Path, result: Result[ShotResult]
) -> None:
    stage = Usd.Stage.Open(str(shot))
    mesh = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    path, count = mesh.GetPath(), len(UsdGeom.Mesh(mesh).GetPointsAttr().Get())
    material = UsdShade.Material.Define(stage, "/Shot/skin")
    UsdShade.MaterialBindingAPI.Apply(mesh).Bind(material)
    preview = Preview(stage, nothing)
    preview.show(layers(result))

    def bound() -> Sdf.Path:
        api = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path))
        return api.ComputeBoundMaterial()[0].GetPath()

    colours = np.random.default_rng(1).random((count, 3)).astype(np.float32)
    for values in (colours, colours[::-1]):
        preview.paint(str(path), values)
        shown = UsdGeom.Mesh(stage.GetPrimAtPath(path)).GetDisplayColorAttr().Get()
        np.testing.assert_array_equal(np.array(shown), values)
        assert bound() == "/usdfaceResidual"
    preview.unpaint()
    assert bound() == "/Shot/skin"
    assert not stage.GetPrimAtPath("/usdfaceResidual")


def test_the_shot_below_a_result_is_processed(shot: Path) -> None:
    beside = process(shot).written[0]
    assert shot_file(Usd.Stage.Open(str(beside))) == (shot, "")
    assert shot_file(Usd.Stage.Open(str(shot))) == (shot, "")


def test_a_stage_without_a_shot_says_what_to_do(shot: Path) -> None:
    found, why = shot_file(Usd.Stage.Open(str(shot.parent / "rig.usda")))
    assert found is None and "usdface shot" in why
    copied = Usd.Stage.CreateInMemory()
    copied.GetRootLayer().TransferContent(Sdf.Layer.FindOrOpen(str(shot)))
    found, why = shot_file(copied)
    assert found is None and why


@pytest.mark.slow
def test_a_stage_is_known_where_the_schemas_came_too_late(shot: Path) -> None:
    """As in usdview with a scene open: its schema registry is closed when a plug-in runs."""
    script = f"""
from pxr import Usd, UsdGeom
UsdGeom.Mesh.Define(Usd.Stage.CreateInMemory(), "/m")
assert not Usd.SchemaRegistry().FindConcretePrimDefinition("UsdFaceRetarget")
from usdface_usdview.preview import shot_file
print(shot_file(Usd.Stage.Open({os.fspath(shot)!r}))[0])
"""
    own = environment(CHECKOUT / "plugins" / "usdview", PXR_PLUGINPATH_NAME="")
    answer = subprocess.run(
        [sys.executable, "-c", script], env=own, capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == str(shot)


def test_two_faces_in_one_stage_are_named(shot: Path, tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    for name in ("A", "B"):
        stage.DefinePrim(f"/{name}").GetReferences().AddReference(os.fspath(shot))
    found, why = shot_file(stage)
    assert found is None and "/A/Retarget, /B/Retarget" in why
