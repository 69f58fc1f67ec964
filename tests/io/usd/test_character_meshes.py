from pathlib import Path

from processed import shoot
from pxr import Usd, UsdGeom, UsdLux
from worlds import make_world

from usdface.pipeline import export_scene, process


def test_a_gltf_of_a_shot_names_what_it_lacks_of_the_stage(tmp_path: Path) -> None:
    """As `export` of the same stage, and cameras, lights and asset, which that writes."""
    make_world().write(tmp_path)
    shot = shoot(tmp_path)
    stage = Usd.Stage.Open(str(shot))
    UsdGeom.Camera.Define(stage, "/Shot/Camera")
    UsdLux.DomeLight.Define(stage, "/Shot/Sky")
    UsdGeom.Sphere.Define(stage, "/Shot/Ball")
    rig = stage.GetPrimAtPath("/Shot/Character")
    UsdGeom.Xform.Define(stage, "/Shot/Character/Socket")
    rig.SetAssetInfoByKey("version", "12")
    for name in ("lod", "animation"):
        chosen = rig.GetVariantSets().AddVariantSet(name)
        for variant in ("high", "low"):
            chosen.AddVariant(variant)
        chosen.SetVariantSelection("high")
    stage.Save()
    lost = {"FEATURE_DROPPED", "CHANNEL_IGNORED", "NODES_DROPPED"}
    found = process(shot, gltf=tmp_path / "face.glb").findings
    told = {(f.code, str(f.values.get("names", f.message))) for f in found if f.code in lost}
    views = {
        ("FEATURE_DROPPED", "['/Shot/Camera']"),
        ("FEATURE_DROPPED", "['/Shot/Sky']"),
    }
    assert views <= told
    found = export_scene(shot, tmp_path / "scene.glb").findings
    exported = {
        (f.code, f.message) for f in found if f.code in lost and "DomeLight" not in f.message
    }
    assert len(exported) == 3  # ball, socket, variants
    (version,) = (one for one in told if "assetInfo" in one[1])
    assert exported == told - views - {version}
    assert not {f.code for f in process(shot).findings} & lost
