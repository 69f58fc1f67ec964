"""Registration is once per process, so each case gets a Python of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import usd_validators
from pxr import Sdf, Usd, UsdGeom, Vt

from usdface.errors import SchemaError
from usdface.pipeline.schemas import register_schemas
from usdface.schemas import plugin_dir, register, tokens, write_fallback_types

KNOWN = """
from pxr import Usd, UsdGeom
stage = Usd.Stage.CreateInMemory()
take = stage.DefinePrim("/Take", "UsdFaceMarkerTake")
assert take.IsA(UsdGeom.Points)
assert take.GetAttribute("usdface:dimension").Get() == "3d"
rule = stage.DefinePrim("/Rule", "UsdFaceFuzzyRule")
assert rule.GetAttribute("usdface:enabled").Get() is True
"""


def run(code: str, *, plugin_path: bool = False) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k != "PXR_PLUGINPATH_NAME"}
    if plugin_path:
        environment["PXR_PLUGINPATH_NAME"] = str(plugin_dir())
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def succeeds(code: str, *, plugin_path: bool = False) -> None:
    result = run(code, plugin_path=plugin_path)
    assert (result.returncode, result.stderr) == (0, "")


REGISTER = "from usdface.schemas import register; register()\n"


@pytest.mark.slow
def test_registered_early() -> None:
    succeeds(REGISTER + KNOWN)


def test_registered_by_the_environment() -> None:
    succeeds(KNOWN, plugin_path=True)


@pytest.mark.slow
def test_registered_by_the_environment_and_again() -> None:
    succeeds(KNOWN + REGISTER, plugin_path=True)


@pytest.mark.slow
def test_registered_twice() -> None:
    succeeds(REGISTER + KNOWN + REGISTER)


def test_not_registered_the_types_are_unknown() -> None:
    assert run(KNOWN).returncode != 0


@pytest.mark.slow
def test_an_empty_stage_is_not_too_late() -> None:
    succeeds("from pxr import Usd; stage = Usd.Stage.CreateInMemory()\n" + REGISTER + KNOWN)


@pytest.mark.slow
@pytest.mark.parametrize(
    "earlier",
    [
        "UsdGeom.Xform.Define(Usd.Stage.CreateInMemory(), '/Asset')",
        "Usd.SchemaRegistry()",
        "Usd.SchemaRegistry.GetTypeFromSchemaTypeName('Mesh')",
    ],
)
def test_too_late_says_what_to_do_each_time(earlier: str) -> None:
    code = f"""
from pxr import Usd, UsdGeom
{earlier}
from usdface.errors import SchemaError
from usdface.schemas import register
for _ in range(2):
    try:
        register()
    except SchemaError as error:
        print(error)
"""
    result = run(code)
    assert (result.returncode, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert len(lines) == 2 and lines[0] == lines[1]
    for word in (tokens.MARKER_TAKE, "before the first stage", "PXR_PLUGINPATH_NAME"):
        assert word in lines[0]


def test_a_package_in_an_archive_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("usdface.schemas.__file__", str(tmp_path / "usdface.whl/usdface/a.py"))
    for job in (register, register_schemas):
        with pytest.raises(SchemaError, match=r"whl/usdface: usdface runs from within an archive"):
            job()


def test_the_plugin_folder_is_found_without_usd() -> None:
    succeeds(
        "import sys, usdface.schemas as s; assert (s.plugin_dir() / 'plugInfo.json').is_file()\n"
        "assert not {'pxr', 'numpy'} & set(sys.modules)"
    )


def stage_with_every_type() -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Asset").GetPrim())
    for name in tokens.FALLBACK_TYPES:
        stage.DefinePrim(f"/Asset/{name}", name)
    take = stage.GetPrimAtPath(f"/Asset/{tokens.MARKER_TAKE}")
    points = take.CreateAttribute(tokens.POINTS, Sdf.ValueTypeNames.Point3fArray, custom=False)
    for code in (0, 1):
        points.Set([(0, code, 0)], code)
    write_fallback_types(stage.GetRootLayer())
    return stage


def test_without_the_schemas_a_layer_composes_and_plays(tmp_path: Path) -> None:
    path = tmp_path / "take.usda"
    stage_with_every_type().Export(str(path))
    succeeds(f"""
from pxr import Usd, UsdGeom
stage = Usd.Stage.Open({str(path)!r})
assert not stage.GetCompositionErrors()
types = {{str(p.GetTypeName()): str(p.GetPrimTypeInfo().GetSchemaTypeName())
         for p in stage.Traverse() if p.GetName() != "Asset"}}
assert types == {tokens.FALLBACK_TYPES!r}, types
take = UsdGeom.Points(stage.GetPrimAtPath("/Asset/UsdFaceMarkerTake"))
assert take
assert [tuple(take.GetPointsAttr().Get(t)[0]) for t in (0, 0.5, 1)] == [
    (0, 0, 0), (0, 0.5, 0), (0, 1, 0)]
""")


@usd_validators.needed
@pytest.mark.parametrize("first", ["", REGISTER], ids=["unregistered", "registered"])
def test_usd_validation_finds_no_error(first: str, tmp_path: Path) -> None:
    path = tmp_path / "take.usda"
    stage_with_every_type().Export(str(path))
    succeeds(
        first
        + f"""
from pxr import Usd, UsdValidation
stage = Usd.Stage.Open({str(path)!r})
validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
assert validators
errors = UsdValidation.ValidationContext(validators).Validate(stage)
assert not errors, [error.GetErrorAsString() for error in errors]
"""
    )


def test_fallback_types_keep_what_is_there() -> None:
    stage = Usd.Stage.CreateInMemory()
    theirs = {"Other": Vt.TokenArray(["Mesh"]), tokens.MARKER_TAKE: Vt.TokenArray(["Xform"])}
    stage.GetRootLayer().pseudoRoot.SetInfo("fallbackPrimTypes", theirs)
    write_fallback_types(stage.GetRootLayer())
    once = stage.GetRootLayer().ExportToString()
    write_fallback_types(stage.GetRootLayer())
    assert stage.GetRootLayer().ExportToString() == once
    written = stage.GetRootLayer().pseudoRoot.GetInfo("fallbackPrimTypes")
    assert {name: list(types) for name, types in written.items()} == {
        **{name: [fallback] for name, fallback in tokens.FALLBACK_TYPES.items()},
        "Other": ["Mesh"],
        tokens.MARKER_TAKE: ["Xform"],
    }


def test_the_root_layer_is_authored_whatever_is_being_edited() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.SetEditTarget(stage.GetSessionLayer())
    write_fallback_types(stage.GetRootLayer())
    assert stage.GetRootLayer().pseudoRoot.HasInfo("fallbackPrimTypes")
    assert not stage.GetSessionLayer().pseudoRoot.HasInfo("fallbackPrimTypes")
