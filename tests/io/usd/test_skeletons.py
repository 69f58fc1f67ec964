"""Several skinned characters on one stage are one skeleton with several roots."""

from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from usdface.clips import Clip, JointsTake
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.skeletons import join_skeletons
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene
from usdface.rigs import Rig, Skeleton


def two_characters(folder: Path, rig: Rig) -> Path:
    """The same character twice, each with a nod of its own; the second one wanders."""
    stage = Usd.Stage.CreateNew(str(folder / "both.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    rest = rig.skeleton.rest[:, 3, :3]
    for name, lean in (("A", 0.6), ("B", -0.28)):
        turns = np.array([[[0, 0, 0, 1.0]] * 2, [[lean, 0, 0, np.sqrt(1 - lean**2)]] * 2])
        moves, sizes = np.tile(rest, (2, 1, 1)), np.ones((2, 2, 3))
        take = JointsTake(rig.skeleton.joints, np.arange(2) / 24, moves, turns, sizes, 24.0)
        write_rig(rig, folder / f"{name}.usda", [Clip(name, joints=take)])
        prim = UsdGeom.Xform.Define(stage, f"/{name}")
        prim.GetPrim().GetReferences().AddReference(f"./{name}.usda")
        if name == "B":
            move = prim.AddTranslateOp()
            for code, x in ((0, 3.0), (1, 4.0)):
                move.Set(Gf.Vec3d(x, 0, 0), code)
    stage.Save()
    return folder / "both.usda"


def test_every_skeleton_moves_its_mesh(tmp_path: Path, skinned_rig: Rig) -> None:
    path = two_characters(tmp_path, skinned_rig)
    rig, (clip,), found = animated_rig(open_stage(path))
    assert [f for f in found if f.severity != "info"] == []
    assert rig.skeleton is not None and clip.joints is not None
    assert rig.skeleton.joints == ("B", "neck", "neck/head", "B/neck_1", "B/neck_1/head")
    done = export_scene(path, tmp_path / "both.glb", every_frame=True)
    assert done.summary["vertex_error_max_mm"] < 1e-2
    assert "CONVERSION_INEXACT" not in {f.code for f in done.findings}


def test_only_roots_of_equal_names_are_renamed() -> None:
    def of(*joints: str) -> Skeleton:
        unit = np.tile(np.eye(4), (len(joints), 1, 1))
        return Skeleton(joints, joints, unit, unit)

    paths = [Sdf.Path(f"/{name}") for name in "abc"]
    given = [of("hip", "hip/neck"), of("tail"), of("hip", "hip/neck")]
    whole, staged = join_skeletons(list(zip(paths, given, strict=True)))
    assert whole is not None
    assert whole.joints == ("hip", "hip/neck", "tail", "hip_1", "hip_1/neck")
    assert staged[2].renamed == {"hip": "hip_1", "hip/neck": "hip_1/neck"}
    assert join_skeletons([]) == (None, ())
