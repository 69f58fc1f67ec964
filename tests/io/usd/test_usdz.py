import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from clips import plays
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation
from usd_validators import skip_without

from usdface.clips import Clip
from usdface.errors import InputError, OutputError
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.io.usd.usdz import write_usdz
from usdface.options import ExportOptions
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.takes import MarkerTake, WeightsTake


def face() -> Rig:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    shape = BlendShape("jawOpen", np.array([2]), np.array([[0, 0, 0.5]]))
    mesh = Mesh("Head", points, np.array([3]), np.array([0, 1, 2]), shapes=(shape,))
    return Rig("Head", (mesh,))


def scene(folder: Path) -> Path:
    take = WeightsTake(("jawOpen",), np.arange(3) / 30, np.array([[0], [0.5], [1.0]]), 30.0)
    write_rig(face(), folder / "rig.usda", plays(take))
    root = Usd.Stage.CreateNew(str(folder / "scene.usda"))
    root.GetRootLayer().subLayerPaths = ["./rig.usda"]
    root.SetTimeCodesPerSecond(30)
    UsdGeom.SetStageMetersPerUnit(root, 1.0)
    root.SetDefaultPrim(root.GetPrimAtPath("/Asset"))
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


def textured(folder: Path, *names: str) -> Path:
    """A scene with an attribute for each file that it names."""
    path = scene(folder)
    layer = Sdf.Layer.FindOrOpen(str(path))
    prim = Sdf.CreatePrimInLayer(layer, "/Asset")
    for number, name in enumerate(names):
        attribute = Sdf.AttributeSpec(prim, f"file{number}", Sdf.ValueTypeNames.Asset)
        attribute.default = Sdf.AssetPath(name)
    layer.Save()
    return path


def test_textures_go_along_and_the_validators_of_usd_agree(tmp_path: Path) -> None:
    for name in ("a.png", "b/a.png", "t.1001.jpg", "t.1012.jpg"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"the content of {name}")
    source = textured(tmp_path, "./a.png", "b/a.png", "./t.<UDIM>.jpg")
    assert write_usdz(source, tmp_path / "face.usdz") == []
    with ZipFile(tmp_path / "face.usdz") as package:
        held = {name: package.read(name).decode() for name in package.namelist()[1:]}
    stage = Usd.Stage.Open(str(tmp_path / "face.usdz"))
    one, other, tiles = (stage.GetAttributeAtPath(f"/Asset.file{n}").Get() for n in range(3))
    assert one.resolvedPath and other.resolvedPath
    assert held == {
        one.path: "the content of a.png",
        other.path: "the content of b/a.png",
        tiles.path.replace("<UDIM>", "1001"): "the content of t.1001.jpg",
        tiles.path.replace("<UDIM>", "1012"): "the content of t.1012.jpg",
    }
    assert complaints(stage) == []


def complaints(stage: Usd.Stage) -> list[str]:
    skip_without()
    registry = UsdValidation.ValidationRegistry()
    about = ("FileExtension", "UsdzPackage", "RootPackage", "PackageEncapsulation")
    names = [f"usdUtilsValidators:{name}Validator" for name in (*about, "MissingReference")]
    context = UsdValidation.ValidationContext(registry.GetOrLoadValidatorsByName(names))
    return [error.GetMessage() for error in context.Validate(stage)]


def test_a_package_goes_into_a_package(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"pixels")
    write_usdz(textured(tmp_path, "./a.png"), tmp_path / "one.usdz")
    (tmp_path / "a.png").unlink()
    assert write_usdz(tmp_path / "one.usdz", tmp_path / "two.usdz") == []
    assert ZipFile(tmp_path / "two.usdz").read("0/a.png") == b"pixels"


def test_what_is_left_out_is_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "notes.txt").write_text("not a texture")
    source = textured(tmp_path, "./gone.png", "./notes.txt", "./tiles.<UDIM>.png", "rig.usda")
    found = write_usdz(source, tmp_path / "face.usdz")
    assert {(f.code, Path(f.where).name) for f in found} == {
        ("TEXTURE_MISSING", "gone.png"),
        ("TEXTURE_MISSING", "tiles.<UDIM>.png"),
        ("FEATURE_DROPPED", "notes.txt"),
    }
    assert ZipFile(tmp_path / "face.usdz").namelist() == ["face.usdc"]
    assert complaints(Usd.Stage.Open(str(tmp_path / "face.usdz"))) == []
    assert capfd.readouterr() == ("", "")


def test_one_clip_is_chosen(tmp_path: Path) -> None:
    takes = [
        WeightsTake(("jawOpen",), np.arange(3) / 30, np.array([[0], [peak / 2], [peak]]), 30.0)
        for peak in (1.0, 0.5)
    ]
    clips = [Clip(name, take) for name, take in zip(("Talk", "Sing"), takes, strict=True)]
    write_rig(face(), tmp_path / "rig.usda", clips)
    output = tmp_path / "face.usdz"
    (found,) = write_usdz(tmp_path / "rig.usda", output)
    assert (found.code, found.where) == ("ANIMATION_DROPPED", "Sing")
    for name, peak in (("Talk", 1.0), ("Sing", 0.5)):
        assert write_usdz(tmp_path / "rig.usda", output, ExportOptions(clip=name)) == []
        _, (clip,), _ = animated_rig(Usd.Stage.Open(str(output)))
        assert clip.name == name and clip.weights.weights.max() == pytest.approx(peak)
    with pytest.raises(InputError, match="no clip 'Cry'; the scene has 'Talk', 'Sing'"):
        write_usdz(tmp_path / "rig.usda", output, ExportOptions(clip="Cry"))


def test_two_runs_give_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"pixels")
    source = textured(tmp_path, "./a.png")
    for year in (10, 40):
        os.utime(tmp_path / "a.png", (year * 3e7, year * 3e7))
        write_usdz(source, tmp_path / str(year) / "face.usdz")
    assert (tmp_path / "10/face.usdz").read_bytes() == (tmp_path / "40/face.usdz").read_bytes()


def test_runs_at_the_same_time_do_not_meet(tmp_path: Path) -> None:
    source, output = scene(tmp_path), tmp_path / "out" / "face.usdz"
    write_usdz(source, output)
    alone = output.read_bytes()
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: write_usdz(source, output), range(8)))
    assert output.read_bytes() == alone and list(output.parent.iterdir()) == [output]


def test_what_cannot_be_read_or_written_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such"):
        write_usdz(tmp_path / "none.usda", tmp_path / "face.usdz")
    source = scene(tmp_path)
    with pytest.raises(OutputError, match="cannot write"):
        write_usdz(source, source / "face.usdz")
