"""`usdface check` on 24 spoilt files: each fault is found, and none on files that are right."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clips import plays
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel
from test_conversion_cases import FAULTS
from worlds import make_world

import usdface
from usdface.io.usd.rig_write import write_rig
from usdface.takes import WeightsTake

NAN, INF = float("nan"), float("inf")
EXAMPLES = Path(__file__).parents[1] / "examples"
OFFSETS, INDICES = "/Asset/Face/head/jawOpen.offsets", "/Asset/Face/head/jawOpen.pointIndices"


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a face that plays a clip, as every format that is checked."""
    folder = tmp_path_factory.mktemp("right")
    rig = make_world().rig
    weights = np.linspace(0, 1, 3)[:, None] * np.ones(len(rig.shape_names))
    take = WeightsTake(rig.shape_names, [0.0, 0.5, 1.0], weights)
    write_rig(rig, folder / "face.usda", plays(take))
    write_rig(rig, folder / "face.usdc", plays(take))
    for name in ("face.glb", "face.gltf", "face.usdz"):
        usdface.export_scene(folder / "face.usda", folder / name)
    return folder


def changed(path: str, change: Callable[[Any], Any]) -> Callable[[Usd.Stage], None]:
    """Change the value of an attribute, in each of its samples."""

    def spoil(stage: Usd.Stage) -> None:
        attribute = stage.GetAttributeAtPath(path)
        for code in attribute.GetTimeSamples() or [Usd.TimeCode.Default()]:
            attribute.Set(change(attribute.Get(code)), code)

    return spoil


def placed(values: Any, place: int, value: Any) -> Any:
    values = list(values)
    values[place] = value
    return values


def mesh_of(stage: Usd.Stage) -> Usd.Prim:
    return stage.GetPrimAtPath("/Asset/Face/head")


def animation(name: str) -> str:
    return f"/Asset/Face/Anim.{name}"


def aim(relation: str, target: str, of: str = "/Asset/Face/head") -> Callable[[Usd.Stage], None]:
    path = Sdf.Path(of).AppendProperty(relation)
    return lambda stage: stage.GetRelationshipAtPath(path).SetTargets([target])


def without_skeleton(stage: Usd.Stage) -> None:
    for prim in stage.Traverse():
        prim.RemoveProperty("skel:skeleton")


def inbetween(stage: Usd.Stage) -> None:
    shape = UsdSkel.BlendShape(stage.GetPrimAtPath("/Asset/Face/head/jawOpen"))
    shape.CreateInbetween("half").SetOffsets(shape.GetOffsetsAttr().Get())


def set_type(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath("/Asset/Face").SetTypeName("Xform")


def of_head(name: str) -> str:
    return f"/Asset/Face/head.{name}"


USD: dict[str, tuple[str, Callable[[Usd.Stage], object]]] = {
    "a point index beyond the mesh": (
        "POINT_INDICES_OUTSIDE",
        changed(INDICES, lambda v: placed(v, -1, 9999)),
    ),
    "a point index twice": (
        "POINT_INDICES_REPEATED",
        changed(INDICES, lambda v: placed(v, 0, v[1])),
    ),
    "an offset too few": ("OFFSETS_LENGTH_WRONG", changed(OFFSETS, lambda v: list(v)[1:])),
    "an offset that is no number": (
        "VALUES_WRONG",
        changed(OFFSETS, lambda v: placed(v, 0, Gf.Vec3f(NAN, 0, 0))),
    ),
    "an offset of 40 m": (
        "POINT_STRAY",
        changed(OFFSETS, lambda v: placed(v, 0, Gf.Vec3f(0, 40, 0))),
    ),
    "a point 40 m away": (
        "POINT_STRAY",
        changed(of_head("points"), lambda v: placed(v, 0, Gf.Vec3f(0, 40, 0))),
    ),
    "a corner beyond the points": (
        "TOPOLOGY_DIFFERS",
        changed(of_head("faceVertexIndices"), lambda v: placed(v, 0, 9999)),
    ),
    "a corner too few": (
        "TOPOLOGY_DIFFERS",
        changed(of_head("faceVertexIndices"), lambda v: list(v)[1:]),
    ),
    "a name without a target": (
        "SHAPE_NAMES_MISMATCH",
        changed(of_head("skel:blendShapes"), lambda v: [*v, "more"]),
    ),
    "a name twice": (
        "SHAPE_NAME_REPEATED",
        changed(of_head("skel:blendShapes"), lambda v: placed(v, 1, v[0])),
    ),
    "a shape that is not there": (
        "SHAPE_TARGET_MISSING",
        lambda stage: stage.RemovePrim("/Asset/Face/head/jawOpen"),
    ),
    "an inbetween without a weight": ("INBETWEEN_WRONG", inbetween),
    "a weight too few": (
        "WEIGHTS_LENGTH_WRONG",
        changed(animation("blendShapeWeights"), lambda v: list(v)[1:]),
    ),
    "an infinite weight": (
        "VALUES_WRONG",
        changed(animation("blendShapeWeights"), lambda v: placed(v, 0, INF)),
    ),
    "a misspelled name in an animation": (
        "SHAPE_UNKNOWN",
        changed(animation("blendShapes"), lambda v: placed(v, 0, "jawopen")),
    ),
    "an animation of another face": (
        "ANIMATION_UNMATCHED",
        changed(animation("blendShapes"), lambda v: [f"Face_{name}" for name in v]),
    ),
    "no SkelRoot": ("SKELROOT_MISSING", set_type),
    "a schema that is not applied": (
        "SCHEMA_UNAPPLIED",
        lambda stage: mesh_of(stage).RemoveAPI(UsdSkel.BindingAPI),
    ),
    "no skeleton": ("SKELETON_MISSING", without_skeleton),
    "a head ten times too large": (
        "RIG_SIZE_UNUSUAL",
        lambda stage: UsdGeom.SetStageMetersPerUnit(stage, 10.0),
    ),
}


def weights_channel(document: dict[str, Any]) -> dict[str, Any]:
    (animated,) = document["animations"]
    place = next(c["sampler"] for c in animated["channels"] if c["target"]["path"] == "weights")
    return animated["samplers"][place]


def shorter(document: dict[str, Any], accessor: int) -> None:
    document["accessors"][accessor]["count"] -= 1


GLTF: dict[str, tuple[str, Callable[[dict[str, Any]], object]]] = {
    "a target name too few": (
        "SHAPE_NAMES_MISMATCH",
        lambda d: d["meshes"][0]["extras"]["targetNames"].pop(),
    ),
    "a target of fewer vertices": (
        "VALUES_WRONG",
        lambda d: shorter(d, d["meshes"][0]["primitives"][0]["targets"][3]["POSITION"]),
    ),
    "fewer weights than keys": (
        "WEIGHTS_LENGTH_WRONG",
        lambda d: shorter(d, weights_channel(d)["output"]),
    ),
    "a weight of the mesh too many": (
        "WEIGHTS_LENGTH_WRONG",
        lambda d: d["meshes"][0].update(weights=[0.0] * 99),
    ),
}


def found_in(path: Path) -> set[str]:
    return {f.code for f in usdface.check(path).findings if f.severity != "info"}


def test_there_are_24() -> None:
    assert len(USD) + len(GLTF) == 24


@pytest.mark.parametrize("fault", USD)
def test_a_fault_of_usd_is_found(right: Path, tmp_path: Path, fault: str) -> None:
    code, spoil = USD[fault]
    layer = Sdf.Layer.FindOrOpen(str(right / "face.usda"))
    layer.Export(str(tmp_path / "face.usda"))
    stage = Usd.Stage.Open(str(tmp_path / "face.usda"))
    spoil(stage)
    stage.Save()
    assert code in found_in(tmp_path / "face.usda")


@pytest.mark.parametrize("fault", GLTF)
def test_a_fault_of_gltf_is_found(right: Path, tmp_path: Path, fault: str) -> None:
    code, spoil = GLTF[fault]
    document = json.loads((right / "face.gltf").read_text())
    spoil(document)
    (tmp_path / "face.gltf").write_text(json.dumps(document))
    (tmp_path / "face.bin").write_bytes((right / "face.bin").read_bytes())
    assert code in found_in(tmp_path / "face.gltf")


def test_nothing_is_found_on_files_that_are_right(right: Path) -> None:
    files = [*right.glob("face.*"), *EXAMPLES.glob("head.usd*")]
    found = {file.name: found_in(file) for file in files if file.suffix != ".bin"}
    assert len(found) == 6 and not any(found.values()), found


@pytest.mark.slow
def test_nothing_is_found_on_the_valid_conversion_cases_and_what_becomes_of_them(
    shared_data: Path, tmp_path: Path
) -> None:
    cases = shared_data / "conversion_cases"
    for source in sorted([*cases.rglob("*.usda"), *cases.rglob("*.glb")]):
        if source.relative_to(cases).as_posix() in FAULTS or source.name.startswith(("vc_", "in_")):
            continue
        assert found_in(source) == set(), source.name
        if source.suffix == ".usda":
            usdface.export_scene(source, tmp_path / "a.glb")
            assert found_in(tmp_path / "a.glb") == set(), source.name
        else:
            usdface.import_scene(source, tmp_path / "a.usda")
            assert found_in(tmp_path / "a.usda") == set(), source.name
