from dataclasses import replace
from pathlib import Path

import pytest
from pxr import Usd, UsdGeom

from usdface.errors import InputError
from usdface.io.check import check_file
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import Rig


def test_usd_and_gltf_by_their_suffix(face_rig, tmp_path, shared_data):
    write_rig(face_rig, tmp_path / "rig.usdc")
    assert check_file(tmp_path / "rig.usdc") == []
    wrong = shared_data / "gltf_validator_morph" / "mesh_morph_weights_wrong_count.gltf"
    assert "WEIGHTS_LENGTH_WRONG" in [f.code for f in check_file(wrong)]


@pytest.mark.parametrize("name", ["rig.usda", "rig.glb", "rig.gltf"])
def test_what_is_not_what_its_name_says_is_one_line(tmp_path, name):
    (tmp_path / name).write_bytes(b"something else")
    with pytest.raises(InputError, match="rig") as caught:
        check_file(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_other_files_and_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        check_file(tmp_path / "none.usda")
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(InputError, match="cannot be checked"):
        check_file(tmp_path / "notes.txt")


def test_a_folder_is_not_called_missing(tmp_path):
    with pytest.raises(InputError, match=r"is a folder; .* `usdface rig` makes one to check"):
        check_file(tmp_path)


def test_a_mesh_of_a_folder_is_checked_as_the_rig_of_it(tmp_path):
    mesh = tmp_path / "blink.obj"
    mesh.write_text("v 0 0 0\n")
    with pytest.raises(InputError, match="`usdface rig` makes one of the folder of an OBJ"):
        check_file(mesh)


@pytest.mark.parametrize("suffix", [".usda", ".glb"])
def test_a_file_without_blend_shapes_is_said_to_have_none(
    face_rig: Rig, tmp_path: Path, suffix: str
) -> None:
    bare = replace(face_rig, meshes=tuple(replace(m, shapes=()) for m in face_rig.meshes))
    write = write_rig if suffix == ".usda" else write_gltf
    for name, rig, codes in (("face", face_rig, []), ("prop", bare, ["SHAPES_ABSENT"])):
        write(rig, tmp_path / f"{name}{suffix}")
        found = check_file(tmp_path / f"{name}{suffix}")
        assert [each.code for each in found if each.code == "SHAPES_ABSENT"] == codes
    stage = Usd.Stage.CreateNew(str(tmp_path / "mesh.usda"))
    UsdGeom.Mesh.Define(stage, "/Mesh")
    stage.Save()
    (found_one,) = check_file(tmp_path / "mesh.usda")
    assert found_one.code == "SHAPES_ABSENT"
