from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from clips import plays
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.errors import InputError, OutputError
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take import write_take
from usdface.io.usd.usdz import write_usdz
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.takes import MarkerTake, WeightsTake


def scene(folder: Path) -> Path:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    shape = BlendShape("jawOpen", np.array([2]), np.array([[0, 0, 0.5]]))
    mesh = Mesh("Head", points, np.array([3]), np.array([0, 1, 2]), shapes=(shape,))
    take = WeightsTake(("jawOpen",), np.arange(3) / 30, np.array([[0], [0.5], [1.0]]), 30.0)
    write_rig(Rig("Head", (mesh,)), folder / "rig.usda", plays(take))
    root = Usd.Stage.CreateNew(str(folder / "scene.usda"))
    root.GetRootLayer().subLayerPaths = ["./rig.usda"]
    root.SetTimeCodesPerSecond(30)
    UsdGeom.SetStageMetersPerUnit(root, 1.0)
    root.Save()
    return folder / "scene.usda"


def test_the_package_plays_by_itself(tmp_path: Path) -> None:
    write_usdz(scene(tmp_path), tmp_path / "out" / "face.usdz")
    assert ZipFile(tmp_path / "out" / "face.usdz").namelist()[0] == "face.usdc"
    (tmp_path / "rig.usda").unlink()
    stage = Usd.Stage.Open(str(tmp_path / "out" / "face.usdz"))
    (animation,) = (p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    weights = UsdSkel.Animation(animation).GetBlendShapeWeightsAttr()
    assert [weights.Get(code)[0] for code in (0, 1, 2)] == [0, 0.5, 1]
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["face.usdz"]


def test_the_name_of_a_takes_source_is_not_packed(tmp_path: Path) -> None:
    source = scene(tmp_path)
    write_take(
        MarkerTake(("chin",), np.zeros(1), np.ones((1, 1, 3)), source="gone.c3d"),
        tmp_path / "take.usda",
    )
    layer = Sdf.Layer.FindOrOpen(str(source))
    layer.subLayerPaths.append("./take.usda")
    layer.Save()
    write_usdz(source, tmp_path / "face.usdz")
    assert Usd.Stage.Open(str(tmp_path / "face.usdz")).GetPrimAtPath("/Take")


def test_two_runs_give_the_same_bytes(tmp_path: Path) -> None:
    source = scene(tmp_path)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_usdz(source, tmp_path / name / "face.usdz")
    assert (tmp_path / "a/face.usdz").read_bytes() == (tmp_path / "b/face.usdz").read_bytes()


def test_what_cannot_be_read_or_written_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such"):
        write_usdz(tmp_path / "none.usda", tmp_path / "face.usdz")
    source = scene(tmp_path)
    with pytest.raises(OutputError, match="cannot write"):
        write_usdz(source, source / "face.usdz")
