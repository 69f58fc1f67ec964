"""Material variants go from glTF to a variant set of USD and back."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from usdface.pipeline import export_scene, import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "<f4")
NAMES = ("skin", "cloth", "rot ü", "blue", "steel")


def mapped(**chosen: list[int]) -> dict[str, Any]:
    mappings = [{"material": int(m[1:]), "variants": v} for m, v in chosen.items()]
    return {"KHR_materials_variants": {"mappings": mappings}}


def shoe() -> dict[str, Any]:
    first = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    second = {"attributes": {"POSITION": 0}, "indices": 2, "material": 1}
    return {
        "extensionsUsed": ["KHR_materials_variants"],
        "extensions": {
            "KHR_materials_variants": {"variants": [{"name": "Rot ü"}, {"name": "sea"}]}
        },
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "Shoe", "mesh": 0}, {"name": "Sole", "mesh": 1}],
        "meshes": [
            {"primitives": [first, second | {"extensions": mapped(m2=[0], m3=[1])}]},
            {"primitives": [first | {"extensions": mapped(m4=[0, 1])}]},
        ],
        "materials": [
            {"name": n, "pbrMetallicRoughness": {"baseColorFactor": [k / 8, 0, 0, 1]}}
            for k, n in enumerate(NAMES)
        ],
    }


def arrays() -> list[np.ndarray]:
    return [POINTS, np.array([0, 1, 2], "<u2"), np.array([2, 1, 3], "<u2")]


def looks(path: Path) -> dict[tuple[str, str, str], str]:
    """Name of the material by mesh, base material and variant, as a player chooses it."""
    data = path.read_bytes()
    document = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    named = [material["name"] for material in document["materials"]]
    variants = [v["name"] for v in document["extensions"]["KHR_materials_variants"]["variants"]]
    shown = {}
    for node in document["nodes"]:
        for primitive in document["meshes"][node["mesh"]]["primitives"]:
            base = named[primitive["material"]]
            held = primitive.get("extensions", {}).get("KHR_materials_variants", {})
            for k, variant in enumerate(variants):
                own = [m["material"] for m in held.get("mappings", []) if k in m["variants"]]
                shown[node["name"], base, variant] = named[own[0]] if own else base
    return shown


def test_there_and_back(write_glb, tmp_path: Path, validate_gltf) -> None:
    source = write_glb(tmp_path / "a.glb", shoe(), arrays())
    there = import_scene(source, tmp_path / "a.usda")
    back = export_scene(tmp_path / "a.usda", tmp_path / "b.glb")
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    assert looks(tmp_path / "b.glb") == looks(source)
    assert looks(source)["Shoe", "cloth", "sea"] == "blue"
    assert validate_gltf(tmp_path / "b.glb")["issues"]["numErrors"] == 0


def test_usd_shows_the_chosen_look(write_glb, tmp_path: Path) -> None:
    import_scene(write_glb(tmp_path / "a.glb", shoe(), arrays()), tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    chosen = stage.GetDefaultPrim().GetVariantSet("material")
    assert chosen.GetVariantSelection() == "default"
    sole = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/Asset/Face/Sole"))
    shown = {}
    for variant in chosen.GetVariantNames():
        chosen.SetVariantSelection(variant)
        shown[variant] = sole.ComputeBoundMaterial()[0].GetPrim().GetName()
    assert shown.pop("default") == "skin" and set(shown.values()) == {"steel"}


def test_the_look_that_was_chosen_in_usd_is_the_default_of_the_gltf(
    write_glb, tmp_path: Path
) -> None:
    source = write_glb(tmp_path / "a.glb", shoe(), arrays())
    import_scene(source, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    stage.GetDefaultPrim().GetVariantSet("material").SetVariantSelection("sea")
    stage.Save()
    export_scene(tmp_path / "a.usda", tmp_path / "b.glb")
    shown = looks(tmp_path / "b.glb")
    assert shown["Shoe", "blue", "Rot ü"] == "rot ü" and shown["Shoe", "blue", "sea"] == "blue"
    assert (
        shown["Shoe", "blue", "default"] == "cloth" and shown["Sole", "steel", "default"] == "skin"
    )


def test_parts_that_share_a_material_and_not_its_variants_are_announced(
    write_glb, tmp_path: Path
) -> None:
    document = shoe()
    for primitive, material in zip(document["meshes"][0]["primitives"], (2, 3), strict=True):
        primitive["material"] = 0
        primitive["extensions"] = mapped(**{f"m{material}": [0]})
    done = import_scene(write_glb(tmp_path / "a.glb", document, arrays()), tmp_path / "a.usda")
    (lost,) = (f for f in done.findings if f.severity != "info")
    assert lost.code == "EXTENSION_DROPPED" and "Shoe" in lost.message
