"""The Maya chaser against a stand-in for its base class; its work on a plain stage."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from checkout import CHECKOUT, environment
from maya_stand_in import Maya, stand_in
from processed import shoot
from pxr import Usd
from usdface_maya.shot import apply
from worlds import make_world

import usdface
from usdface.pipeline import process


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """rig.usda, take.usda, bind.json and the shot of them."""
    return shoot(make_world().write(tmp_path_factory.mktemp("maya"))).parent


@pytest.fixture
def maya(monkeypatch: pytest.MonkeyPatch) -> Maya:
    """Maya after its start, with the chaser registered by userSetup.py."""
    found = stand_in(monkeypatch)
    importlib.import_module("userSetup")
    assert not found.chasers  # only once Maya is up
    for function in found.deferred:
        function()
    assert found.plugins == ["mayaUsdPlugin"] and list(found.chasers) == ["usdface"]
    assert not found.warnings
    return found


def exported(folder: Path) -> Usd.Stage:
    """What Maya has on its stage: the character, and nothing of ours."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().TransferContent(Usd.Stage.Open(str(folder / "rig.usda")).Flatten())
    return stage


def options(folder: Path, **more: str) -> dict[str, str]:
    return {"take": str(folder / "take.usda"), "bind": str(folder / "bind.json")} | more


def played(stage: Usd.Stage) -> np.ndarray:
    (prim,) = (p for p in stage.Traverse() if p.GetTypeName() == "SkelAnimation")
    attribute = prim.GetAttribute("blendShapeWeights")
    return np.array([attribute.Get(code) for code in attribute.GetTimeSamples()])


@pytest.mark.slow
def test_the_exported_face_plays_what_process_computes(maya: Maya, folder: Path) -> None:
    stage = exported(folder)
    assert maya.export(stage, options(folder))
    written = process(folder / "shot.usda", output=folder / "result" / "shot.usdface.usda")
    expected = played(Usd.Stage.Open(str(written.written[0])))
    np.testing.assert_allclose(played(stage), expected, atol=1e-6)
    assert maya.extra == ["/UsdFace"] and not maya.errors
    assert "40 frames, verdict: " in maya.messages[0]


@pytest.mark.slow
def test_options_are_strings_and_have_an_effect(maya: Maya, folder: Path) -> None:
    plain, raw, softer = (exported(folder) for _ in range(3))
    assert maya.export(plain, options(folder))
    assert maya.export(raw, options(folder, express="0", closure="0", scope="/Face/Setup"))
    assert maya.export(softer, options(folder, gains="joy=0, surprise=0", closure="0"))
    assert raw.GetPrimAtPath("/Face/Setup")
    assert np.abs(played(plain) - played(raw)).max() > 0.05
    assert np.abs(played(plain) - played(softer)).max() > 0.05


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"take": "missing.c3d"}, "missing.c3d"),
        ({"take": ""}, "take=FILE"),
        ({"profile": "arkit"}, "there is no option 'profile'"),
        ({"express": "perhaps"}, "expected 0 or 1"),
        ({"gains": "joy=much"}, "expected factors: joy=0.5"),
        ({"exaggeration": "1,2"}, "expected factors: 1.1,brows=1.4"),
        ({"neutral": "first"}, "expected the first and last frame index"),
        ({"rig": "/Nowhere"}, "/Nowhere"),
        ({"skip_hooks": "acme"}, "no such hook"),
    ],
)
def test_an_error_is_shown_and_the_export_goes_on_as_it_was(
    maya: Maya, folder: Path, wrong: dict[str, str], message: str
) -> None:
    stage = exported(folder)
    before = stage.GetRootLayer().ExportToString()
    assert maya.export(stage, options(folder) | wrong)
    (shown,) = maya.errors
    assert message in shown and shown.endswith("(the face is exported without it)")
    assert stage.GetRootLayer().ExportToString() == before


def test_an_export_is_stopped_only_on_request_and_never_silently(maya: Maya, folder: Path) -> None:
    assert not maya.export(exported(folder), options(folder, take="missing.c3d", on_error="stop"))
    assert "the export is stopped" in maya.errors[0]


def test_without_options_or_a_rig_it_says_so(maya: Maya, folder: Path) -> None:
    assert maya.export(exported(folder), None)
    assert "take=FILE" in maya.errors[0]
    assert maya.export(Usd.Stage.CreateInMemory(), options(folder))
    assert "SkelRoot" in maya.errors[1] or "rig" in maya.errors[1]


def test_two_faces_in_one_scene_are_named(maya: Maya, folder: Path) -> None:
    stage = Usd.Stage.CreateInMemory()
    for name in ("A", "B"):
        stage.DefinePrim(f"/{name}").GetReferences().AddReference(os.fspath(folder / "rig.usda"))
    before = stage.GetRootLayer().ExportToString()
    assert maya.export(stage, options(folder))
    assert "/A/Face" in maya.errors[0] and "/B/Face" in maya.errors[0]
    assert stage.GetRootLayer().ExportToString() == before
    assert maya.export(stage, options(folder, rig="/B/Face"))
    assert len(maya.errors) == 1


def test_a_mistake_of_ours_costs_no_export(
    maya: Maya, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("usdface_maya.shot.usdface.apply", broken)
    assert maya.export(exported(folder), options(folder))
    assert "ZeroDivisionError: division by zero" in maya.errors[0]


def test_a_stage_with_a_set_up_needs_no_options(folder: Path) -> None:
    stage = Usd.Stage.Open(str(folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    result = apply(stage, {})
    assert result.summary["frames"] == 40 and isinstance(result, usdface.Result)


def test_maya_starts_without_its_usd_plug_in(monkeypatch: pytest.MonkeyPatch) -> None:
    found = stand_in(monkeypatch)
    importlib.import_module("userSetup")
    monkeypatch.setitem(sys.modules, "mayaUsd.lib", None)  # cannot be imported
    for function in found.deferred:
        function()
    assert "usdface is not registered" in found.warnings[0]


@pytest.mark.slow
def test_schemas_that_come_too_late_change_nothing(folder: Path) -> None:
    """Maya has stages open before our code runs: USD's schema registry is closed by then."""
    script = f"""
import numpy as np
from pxr import Usd, UsdGeom
open_before = Usd.Stage.CreateInMemory()
UsdGeom.Mesh.Define(open_before, "/m")
assert not Usd.SchemaRegistry().FindConcretePrimDefinition("UsdFaceRetarget")
from usdface_maya.shot import apply
stage = Usd.Stage.Open({os.fspath(folder / "rig.usda")!r})
stage.SetEditTarget(stage.GetSessionLayer())
result = apply(stage, {options(folder)!r})
print(result.summary["frames"], np.round(result.value.weights.weights.sum(), 6))
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment(CHECKOUT / "plugins" / "maya", PXR_PLUGINPATH_NAME=""),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    stage = exported(folder)
    here = apply(stage, options(folder))
    assert done.stdout.split() == ["40", str(np.round(here.value.weights.weights.sum(), 6))]
