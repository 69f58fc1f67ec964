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


def test_targets_without_a_base_mesh_are_mentioned(tmp_path):
    triangle = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
    (tmp_path / "frown.target").write_text("0 0 -1 0\n")
    with pytest.raises(InputError, match=r"1 MakeHuman \.target files but no base mesh: base\.obj"):
        read_rig_file(tmp_path)
    (tmp_path / "human.obj").write_text(triangle)
    assert read_rig_file(tmp_path, RigOptions(neutral="human"))[0].shape_names == ("frown",)
    # Several meshes are shapes of a folder; they may be a body and its eyes.
    (tmp_path / "eyes.obj").write_text("v 0 0 0\n" + triangle)
    with pytest.raises(InputError, match=r"its 1 MakeHuman \.target files need their mesh"):
        read_rig_file(tmp_path, RigOptions(neutral="human"))
    (tmp_path / "smile.obj").write_text(triangle)
    _, findings = read_rig_file(tmp_path, RigOptions(neutral="human"))
    (dropped,) = [f for f in findings if f.code == "FEATURE_DROPPED"]
    assert dropped.values == {"file_count": 1, "feature": "makehuman_targets"}


def test_a_folder_with_one_mesh_says_what_it_lacks(tmp_path):
    (tmp_path / "base.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"no blend shapes; .* a file for each shape"):
        read_rig_file(tmp_path)


def test_an_empty_folder_is_said_to_be_empty(tmp_path):
    (tmp_path / ".DS_Store").touch()
    with pytest.raises(InputError, match="empty folders are not read; expected folder of OBJ"):
        read_rig_file(tmp_path)
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="folders like this are not read"):
        read_rig_file(tmp_path)


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
