"""Cameras, lights and extras go from glTF to USD and back, and the other way."""

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdLux
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation

from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material
from usdface.rigs import Mesh, Rig
from usdface.scene import Camera, Light

KEPT = {
    "rig": "ICT é",
    "take": 7,
    "gain": 0.5,
    "final": True,
    "scores": [0.5, 1.0],
    "frames": [1, 2, 3],
    "tags": ["a", "口"],
    "deep": {"er": {"still": "here"}},
}


def standing(seed: int) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    matrix[3, :3] = np.random.default_rng(seed).normal(size=3)
    return matrix


def scene() -> Rig:
    cameras = (
        Camera("Close up", standing(1), 0.5, 1.5, 0.01, 20.0, extras={"lens": "85 mm"}),
        Camera("endless", standing(2), 1.0),
        Camera("flat", standing(3), 3.0, 0.75, 0.5, 9.0, False),
    )
    lights = (
        Light("Sun", "directional", standing(4), (1.0, 0.5, 0.25), 10_000.0),
        Light("bulb", "point", standing(5), (1.0, 1.0, 1.0), 80.0, reach=5.0),
        Light("口", "spot", standing(6), (0.5, 1.0, 0.0), 12.5, 0.25, 0.75, extras={"x": 1}),
        Light("edge", "spot", standing(7), (1.0, 1.0, 1.0), 2.0, 0.5, 0.5 + 1e-3),
    )
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], np.eye(3), material="skin", extras=KEPT)
    skin = Material("skin", extras={"shader": {"kind": "sss"}})
    asset = {"copyright": "2026 nobody", "note": "a"}
    return Rig("r", (mesh,), None, (skin,), "", cameras, lights, {"scene": 1}, asset)


def through_usd(rig: Rig, folder: Path) -> Rig:
    write_rig(rig, folder / "way.usda")
    return read_rig(folder / "way.usda")[0]


def through_gltf(rig: Rig, folder: Path) -> Rig:
    write_gltf(rig, folder / "way.glb")
    return read_gltf(folder / "way.glb")[0]


def assert_alike(one: object, other: object) -> None:
    for field in fields(one):  # type: ignore[arg-type]
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, str | bool | dict):
            assert a == b, field.name
        else:
            np.testing.assert_allclose(b, a, rtol=1e-5, atol=1e-5, err_msg=field.name)


@pytest.mark.parametrize("way", [through_usd, through_gltf])
def test_a_scene_comes_back(
    tmp_path: Path, way: Callable, assert_valid_usd: Callable, validate_gltf: Callable
) -> None:
    given = scene()
    back = way(given, tmp_path)
    assert len(back.cameras) == 3 and len(back.lights) == 4
    for one, other in zip(given.cameras + given.lights, back.cameras + back.lights, strict=True):
        assert_alike(one, other)
    assert back.meshes[0].extras == KEPT
    assert back.materials[0].extras == given.materials[0].extras
    assert (back.extras, back.asset) == (given.extras, given.asset)
    if way is through_usd:
        assert_valid_usd(tmp_path / "way.usda")
    else:
        report = validate_gltf(tmp_path / "way.glb")
        assert report["issues"]["numErrors"] == 0, report


def test_both_ways_together_change_nothing_more(tmp_path: Path) -> None:
    first = through_gltf(through_usd(scene(), tmp_path), tmp_path)
    (tmp_path / "one.glb").write_bytes((tmp_path / "way.glb").read_bytes())
    through_gltf(through_usd(first, tmp_path), tmp_path)
    one, two = GLTF2.load(str(tmp_path / "one.glb")), GLTF2.load(str(tmp_path / "way.glb"))
    assert one.extensions.keys() == two.extensions.keys()
    assert [n.extras for n in one.nodes] == [n.extras for n in two.nodes]


def test_what_usd_lights_lack_is_said(tmp_path: Path) -> None:
    found = write_rig(scene(), tmp_path / "a.usda")
    assert [f.code for f in found].count("FEATURE_APPROXIMATED") == 3  # a range, two fading cones


def a_stage(folder: Path) -> Usd.Stage:
    write_rig(replace(scene(), cameras=(), lights=()), folder / "a.usda")
    return Usd.Stage.Open(str(folder / "a.usda"))


def read_back(stage: Usd.Stage, folder: Path) -> tuple[Rig, list[str]]:
    stage.Export(str(folder / "b.usda"))
    rig, found = read_rig(folder / "b.usda")
    return rig, [f.code for f in found]


def test_a_sphere_shines_as_its_luminance_and_size_say(tmp_path: Path) -> None:
    stage = a_stage(tmp_path)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    light = UsdLux.SphereLight.Define(stage, "/Asset/Lamp")
    light.CreateRadiusAttr(20.0)  # centimetres
    light.CreateIntensityAttr(100.0)
    light.CreateExposureAttr(1.0)
    rig, found = read_back(stage, tmp_path)
    assert rig.lights[0].intensity == pytest.approx(200 * np.pi * 0.2**2)
    light.CreateNormalizeAttr(True)
    assert read_back(stage, tmp_path)[0].lights[0].intensity == pytest.approx(50)
    assert found == []


def test_cameras_and_lights_of_instances_stand_where_these_do(tmp_path: Path) -> None:
    given = scene()
    write_rig(given, tmp_path / "a.usda")
    stage = Usd.Stage.CreateNew(str(tmp_path / "set.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(24)
    for x in (0.0, 5.0):
        placed = UsdGeom.Xform.Define(stage, f"/Head_{x:.0f}")
        placed.AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
        placed.GetPrim().GetReferences().AddReference("a.usda")
        placed.GetPrim().SetInstanceable(True)
    stage.Save()
    rig = read_rig(tmp_path / "set.usda")[0]
    for found, wanted in ((rig.cameras, given.cameras), (rig.lights, given.lights)):
        assert [one.name for one in found] == 2 * [one.name for one in wanted]
        move = found[len(wanted)].matrix - wanted[0].matrix
        np.testing.assert_allclose(move[3], [5, 0, 0, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("focalLength", 0.0),
        ("verticalAperture", 0.0),
        ("focalLength", np.nan),
        ("clippingRange", (1.0, 0.5)),
        ("inputs:intensity", -5.0),
        ("inputs:intensity", np.inf),
        ("inputs:exposure", 2000.0),
        ("inputs:color", (np.nan, 0.0, 0.0)),
    ],
)
def test_a_camera_or_light_that_gltf_cannot_hold_is_announced(
    tmp_path: Path, name: str, wrong: object
) -> None:
    stage = a_stage(tmp_path)
    kind = UsdLux.SphereLight if name.startswith("inputs:") else UsdGeom.Camera
    thing = kind.Define(stage, "/Asset/Thing").GetPrim()
    thing.GetAttribute(name).Set(wrong)
    rig, found = read_back(stage, tmp_path)
    assert rig.cameras == rig.lights == () and found == ["FEATURE_DROPPED"]


def test_a_lamp_that_an_instancer_repeats_is_not_where_it_stands(tmp_path: Path) -> None:
    stage = a_stage(tmp_path)
    UsdGeom.PointInstancer.Define(stage, "/Asset/Chain").CreateProtoIndicesAttr([0, 0])
    UsdLux.SphereLight.Define(stage, "/Asset/Chain/Lamp")
    rig, found = read_back(stage, tmp_path)
    assert rig.lights == () and found == ["FEATURE_DROPPED"]  # the instancer


def test_the_sun_shines_as_its_disc_says(tmp_path: Path) -> None:
    stage = a_stage(tmp_path)
    light = UsdLux.DistantLight.Define(stage, "/Asset/Sun")
    light.CreateAngleAttr(60.0)
    light.CreateIntensityAttr(100.0)
    light.CreateColorAttr(Gf.Vec3f(0.0, 2.0, 1.0))
    (sun,) = read_back(stage, tmp_path)[0].lights
    assert sun.intensity == pytest.approx(200 * np.pi / 4)
    assert sun.colour == (0.0, 1.0, 0.5)


def test_lights_that_gltf_lacks_and_motion_are_announced(tmp_path: Path) -> None:
    stage = a_stage(tmp_path)
    UsdLux.DomeLight.Define(stage, "/Asset/Sky")
    camera = UsdGeom.Camera.Define(stage, "/Asset/Cam")
    move = camera.AddTranslateOp()
    move.Set((0, 0, 1), 0)
    move.Set((0, 0, 2), 1)
    hidden = UsdLux.SphereLight.Define(stage, "/Asset/Off")
    hidden.MakeInvisible()
    rig, found = read_back(stage, tmp_path)
    assert found == ["FEATURE_DROPPED", "ANIMATION_DROPPED"]
    assert rig.lights == ()
    # A rig in USD: what glTF lacks alone would be no reason.
    sky = next(f for f in read_rig(tmp_path / "b.usda")[1] if f.code == "FEATURE_DROPPED")
    assert "points, spots and distant lights are kept" in sky.message
    assert rig.cameras[0].matrix[3, 2] == 1


def test_extras_that_usd_cannot_hold_are_announced(tmp_path: Path) -> None:
    extras = {"null": None, "mixed": [1, "a"], "a:b": 1, "big": 2**70, "usdface": {"x": 1}, "ok": 1}
    extras |= {"sizes": [0.5, 10**400]}
    rig = scene()
    rig = replace(rig, meshes=(replace(rig.meshes[0], extras=extras),))
    found = write_rig(rig, tmp_path / "a.usda")
    assert [f.message for f in found if f.code == "FEATURE_DROPPED"] == [
        "extras that USD does not hold: a:b, big, mixed, null, sizes, usdface"
    ]
    assert read_rig(tmp_path / "a.usda")[0].meshes[0].extras == {"ok": 1}


def test_metadata_that_json_cannot_hold_is_announced(tmp_path: Path) -> None:
    stage = a_stage(tmp_path)
    stage.GetDefaultPrim().SetCustomDataByKey("far", float("inf"))
    stage.GetDefaultPrim().SetCustomDataByKey("range", Gf.Vec2d(0, np.nan))
    stage.GetDefaultPrim().SetCustomDataByKey("ok", Gf.Vec2d(0, 1))
    stage.Export(str(tmp_path / "b.usda"))
    rig, found = read_rig(tmp_path / "b.usda")
    assert [f.message for f in found] == ["metadata that JSON does not hold: far, range"]
    assert rig.extras["ok"] == [0, 1]
    assert write_gltf(rig, tmp_path / "b.glb") == []


def test_huge_extras_are_left_out(tmp_path: Path, write_glb: Callable) -> None:
    document = {
        "nodes": [{"mesh": 0, "extras": {"a": "x" * 2**20}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    path = write_glb(tmp_path / "a.glb", document, [np.eye(3, dtype="<f4")])
    rig, _, found = read_gltf(path)
    assert rig.meshes[0].extras == {}
    assert [f.code for f in found] == ["FEATURE_DROPPED"]


@pytest.mark.parametrize(
    ("camera", "light", "message"),
    [
        ({"type": "perspective", "perspective": {"yfov": -1, "znear": 1}}, None, "number -1"),
        ({"type": "wide"}, None, "neither perspective nor"),
        (None, {"type": "laser"}, "of type 'laser'"),
        (None, {"type": "point", "intensity": -1}, "make no sense"),
        (None, {"type": "point", "color": [1, 1]}, "make no sense"),
    ],
)
def test_nonsense_is_one_line(
    tmp_path: Path, write_glb: Callable, camera: dict | None, light: dict | None, message: str
) -> None:
    node = {"camera": 0} if camera else {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    document = {
        "nodes": [{"mesh": 0}, node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "cameras": [camera] if camera else [],
        "extensions": {"KHR_lights_punctual": {"lights": [light] if light else []}},
    }
    path = write_glb(tmp_path / "a.glb", document, [np.eye(3, dtype="<f4")])
    from usdface.errors import InputError

    with pytest.raises(InputError, match=message):
        read_gltf(path)
