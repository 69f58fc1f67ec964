import pytest
from pxr import Usd, UsdSkel

from usdface.errors import InputError
from usdface.io.rigs.files import read_rig_file
from usdface.io.usd.rig_write import write_rig
from usdface.options import RigOptions
from usdface.rigs import Mesh, Rig


def test_usd_by_its_suffix(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "rig.usdc")
    assert read_rig_file(tmp_path / "rig.usdc")[0].shape_names == face_rig.shape_names


def test_folders_by_what_is_in_them(tmp_path):
    triangle = "v 0 0 0\nv 1 0 0\nv 1 1 0\ng body\nf 1 2 3\n"
    (tmp_path / "base.obj").write_text(triangle)
    (tmp_path / "smile.obj").write_text(triangle.replace("1 1 0", "1 2 0"))
    rig, _ = read_rig_file(tmp_path, RigOptions(meters_per_unit=1.0))
    assert rig.shape_names == ("smile",)
    (tmp_path / "frown.target").write_text("0 0 -1 0\n")
    assert read_rig_file(tmp_path)[0].shape_names == ("frown",)


def test_gltf_by_its_suffix(shared_data):
    path = shared_data / "gltf_morph" / "AnimatedMorphCube" / "glTF" / "AnimatedMorphCube.gltf"
    assert len(read_rig_file(path)[0].shape_names) == 2


def test_what_is_no_rig_is_said(tmp_path):
    with pytest.raises(InputError, match="no such file or folder"):
        read_rig_file(tmp_path / "none.usda")
    (tmp_path / "rig.txt").write_text("")
    with pytest.raises(InputError, match=r"rigs of kind '\.txt' are not read; expected glTF"):
        read_rig_file(tmp_path / "rig.txt")
    write_rig(
        Rig("r", (Mesh("M", [[0, 0, 0], [1, 0, 0], [1, 1, 0]], [3], [0, 1, 2]),)),
        tmp_path / "bare.usda",
    )
    with pytest.raises(InputError, match="no blend shapes"):
        read_rig_file(tmp_path / "bare.usda")


def test_a_broken_animation_does_not_keep_a_rig_from_being_read(face_rig, tmp_path):
    """It is left out anyhow, with a word on what is wrong with it."""
    write_rig(face_rig, tmp_path / "face.usda")
    stage = Usd.Stage.Open(str(tmp_path / "face.usda"))
    skeleton = next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton))
    animation = UsdSkel.Animation.Define(stage, "/Broken")
    animation.CreateBlendShapesAttr([face_rig.shape_names[0]])
    animation.CreateBlendShapeWeightsAttr().Set([0.5, 0.5], 1)
    animation.GetBlendShapeWeightsAttr().Set([0.5], 2)
    UsdSkel.BindingAPI.Apply(skeleton).CreateAnimationSourceRel().SetTargets(["/Broken"])
    stage.Save()
    rig, findings = read_rig_file(tmp_path / "face.usda")
    assert rig.shape_names == face_rig.shape_names
    (dropped,) = [f for f in findings if f.code == "ANIMATION_DROPPED"]
    assert "2 blendShapeWeights for 1 blendShapes" in dropped.message
