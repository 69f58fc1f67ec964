import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.rigs.obj import read_obj

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 2\n"


def written(tmp_path, text):
    path = tmp_path / "mesh.obj"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "faces", ["f 1 2 3 4\nf 1 2 3", "f -5 -4 -3 -2\nf -5 -4 -3", "f 1 2 \\\n3 4\r\nf\t1 2 3"]
)
def test_polygons_and_points_stay_as_they_stand_in_the_file(tmp_path, faces):
    mesh = read_obj(written(tmp_path, SQUARE + faces))
    assert mesh.points.shape == (5, 3) and mesh.uvs is None
    assert list(mesh.face_counts) == [4, 3]
    assert list(mesh.face_indices) == [0, 1, 2, 3, 0, 1, 2]


def test_negative_indices_count_back_from_their_own_line(tmp_path):
    mesh = read_obj(written(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 9 9 9\n"))
    assert list(mesh.face_indices) == [0, 1, 2]


def test_a_byte_order_mark_hides_no_point(tmp_path):
    mesh = read_obj(written(tmp_path, "\ufeff" + SQUARE + "f 1 2 3"))
    assert len(mesh.points) == 5


def test_texture_seams_do_not_split_points(tmp_path):
    text = SQUARE + "vt 0 0\nvt 1 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/2/1 3/3/1 4/1/1\n"
    mesh = read_obj(written(tmp_path, text))
    assert len(mesh.points) == 5
    np.testing.assert_array_equal(mesh.uvs, [(0, 0), (1, 0), (1, 1), (1, 0), (1, 1), (0, 0)])


def test_groups_and_materials_stand_above_their_faces(tmp_path):
    text = SQUARE + "f 1//1 2//1 3//1\ng body part\nusemtl Skin\nf 1//1 2//1 3//1\n"
    mesh = read_obj(written(tmp_path, text))
    assert (mesh.groups, mesh.materials) == (("", "body part"), ("", "Skin"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no OBJ points"),
        ("\x00\xff garbage", "no OBJ points"),
        ("v 1 2\nf 1 1 1", "does not hold 3 numbers"),
        ("v 1 2 x\n", "does not hold 3 numbers"),
        ("v nan 0 0\n", "not finite"),
        (SQUARE + "f 1 2 9\n", "not among the file's 5"),
        (SQUARE + "f 0 1 2\n", "not among the file's 5"),
        (SQUARE + "f 1/1 2 3\n", "not all written alike"),
        (SQUARE + "f 1 2 99999999999999999999\n", "not all written alike"),
        (SQUARE + "vt 0 0\nf 1/1 2/2 3/1\n", "texture"),
    ],
)
def test_a_damaged_file_is_one_clear_line(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read_obj(written(tmp_path, text))
    assert "mesh.obj" in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        read_obj(tmp_path / "none.obj")
