import numpy as np
import pytest
import trimesh

from usdface.errors import InputError
from usdface.io.rigs.shape_folder import read_shape_folder
from usdface.options import RigOptions

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 5.0]])
METRES = RigOptions(meters_per_unit=1.0)


def obj(folder, name, points, faces="f 1 2 3 4\n"):
    rows = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    (folder / name).write_text(rows + faces)


def ply(folder, name, points):
    trimesh.Trimesh(points, [[0, 1, 2], [0, 2, 3]], process=False).export(folder / name)


def moved(vertex, by):
    points = POINTS.copy()
    points[vertex] += by
    return points


@pytest.mark.parametrize("write", [obj, ply])
def test_a_shape_is_its_difference_to_the_neutral(tmp_path, write):
    suffix = write.__name__
    write(tmp_path, f"face_neutral.{suffix}", POINTS)
    write(tmp_path, f"face_smile.{suffix}", moved(2, (0, 0.5, 0)))
    write(tmp_path, f"Brow up.{suffix}", moved(0, (0, 0, 0.25)))
    # What macOS leaves beside a file on drives of other systems.
    (tmp_path / f"._Brow up.{suffix}").write_bytes(b"\0\5\x16\7Mac OS X")
    rig, findings = read_shape_folder(tmp_path, METRES)
    mesh = rig.mesh()
    assert findings == [] and mesh.shape_names == ("Brow up", "face_smile")
    np.testing.assert_array_equal(mesh.points, POINTS)
    assert [list(s.indices) for s in mesh.shapes] == [[0], [2]]
    np.testing.assert_array_equal(mesh.shapes[1].offsets, [(0, 0.5, 0)])
    assert list(mesh.face_counts) == ([4] if write is obj else [3, 3])


STRIP = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [3, 0, 1.0]])


@pytest.mark.parametrize(
    ("faces", "expected"),
    [
        ("f 2 5 6 3\nf 7 6 5\nf 3 4 1 2\n", []),  # another order, other first corners
        ("f 1 2 3 4\nf 2 5 6 3\nf 5 6 7\n", ["FACES_DIFFER"]),  # one is turned over
        ("f 1 2 3 4\nf 2 5 6 3\nf 5 7 4\n", ["FACES_DIFFER"]),
        ("f 1 2 3 4\nf 2 5 6 3\n", ["FACES_DIFFER"]),
        ("f 1 2 3\nf 1 3 4\nf 2 5 6 3\nf 5 7 6\n", ["FACES_DIFFER"]),
        ("", []),
    ],
)
def test_faces_may_come_in_another_order(tmp_path, faces, expected):
    obj(tmp_path, "neutral.obj", STRIP, "f 1 2 3 4\nf 2 5 6 3\nf 5 7 6\n")
    obj(tmp_path, "up.obj", STRIP + np.array([0, 0.5, 0]), faces)
    rig, findings = read_shape_folder(tmp_path, METRES)
    assert [f.code for f in findings] == expected
    np.testing.assert_allclose(rig.mesh().shapes[0].offsets, np.tile((0, 0.5, 0), (7, 1)))


def test_units_and_up_axis_come_from_the_options(tmp_path):
    obj(tmp_path, "neutral.obj", POINTS)
    obj(tmp_path, "up.obj", moved(1, (0, 0, 2)))
    rig, _ = read_shape_folder(tmp_path, RigOptions(meters_per_unit=0.01, up_axis="Z"))
    np.testing.assert_allclose(rig.mesh().points[3], (0, 0.05, -0.01))
    np.testing.assert_allclose(rig.mesh().shapes[0].offsets, [(0, 0.02, 0)])


@pytest.mark.parametrize("name", ["Neutral", "head_rest", "01-base", "myneutralface", "Basis"])
def test_the_neutral_is_known_by_its_name(tmp_path, name):
    obj(tmp_path, f"{name}.obj", POINTS)
    obj(tmp_path, "smile.obj", moved(0, 1))
    rig, _ = read_shape_folder(tmp_path, METRES)
    assert rig.mesh().name == name


@pytest.mark.parametrize("wanted", ["b", "b.obj"])
def test_the_neutral_can_be_named(tmp_path, wanted):
    for name, points in (("a.obj", POINTS), ("b.obj", moved(0, 1)), ("rest.obj", moved(1, 1))):
        obj(tmp_path, name, points)
    rig, _ = read_shape_folder(tmp_path, RigOptions(neutral=wanted))
    assert rig.mesh().name == "b" and rig.shape_names == ("a", "rest")


@pytest.mark.parametrize(
    ("names", "wanted", "message"),
    [
        (("a.obj", "b.obj"), "", "choose one with --neutral: a.obj, b.obj"),
        (("a_neutral.obj", "b_rest.obj"), "", "several neutral"),
        (("neutral.obj", "b.obj"), "c", "no mesh 'c'"),
        ((), "", "no OBJ or PLY files"),
    ],
)
def test_no_one_neutral_is_an_error_that_lists_the_files(tmp_path, names, wanted, message):
    for name in names:
        obj(tmp_path, name, POINTS)
    with pytest.raises(InputError, match=message):
        read_shape_folder(tmp_path, RigOptions(neutral=wanted))


def test_what_does_not_fit_is_left_out_and_said(tmp_path):
    obj(tmp_path, "neutral.obj", POINTS)
    obj(tmp_path, "same.obj", POINTS)
    obj(tmp_path, "short.obj", POINTS[:3], "f 1 2 3\n")
    obj(tmp_path, "turned.obj", moved(0, 1), "f 4 3 2 1\n")
    obj(tmp_path, "twice.obj", moved(0, 1))
    ply(tmp_path, "twice.ply", moved(0, 2))
    rig, findings = read_shape_folder(tmp_path, METRES)
    assert rig.shape_names == ("same", "turned", "twice")
    assert [(f.code, f.where.rpartition("/")[2]) for f in findings] == [
        ("SHAPE_EMPTY", "same.obj"),
        ("SHAPE_SKIPPED", "short.obj"),
        ("FACES_DIFFER", "turned.obj"),
        ("SHAPE_SKIPPED", "twice.ply"),
    ]


def test_polygons_of_a_ply_become_triangles_and_that_is_said(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    header += "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    (tmp_path / "neutral.ply").write_text(header + "end_header\n" + rows + "4 0 1 2 3\n")
    rig, findings = read_shape_folder(tmp_path, METRES)
    assert list(rig.meshes[0].face_counts) == [3, 3]
    assert [f.code for f in findings] == ["FACES_TRIANGULATED"]


@pytest.mark.parametrize(
    "data", [b"", b"ply\n", b"not a ply", b"ply\nformat ascii 1.0\nelement vertex 9\nend_header\n"]
)
def test_a_damaged_ply_is_one_clear_line(tmp_path, data):
    (tmp_path / "neutral.ply").write_bytes(data)
    with pytest.raises(InputError, match=r"neutral\.ply"):
        read_shape_folder(tmp_path, METRES)


@pytest.mark.slow
def test_a_folder_of_real_scans_keeps_quads_and_order(shared_data):
    folder = shared_data / "ict_facekit"
    rig, findings = read_shape_folder(folder, RigOptions())
    packed = np.load(folder / "ict_expressions.npz")
    mesh = rig.mesh()
    assert {f.code for f in findings} == {"FEATURE_DROPPED"}
    np.testing.assert_allclose(mesh.points, 0.01 * packed["points"], atol=1e-7)
    np.testing.assert_array_equal(mesh.face_counts, packed["faceVertexCounts"])
    np.testing.assert_array_equal(mesh.face_indices, packed["faceVertexIndices"])
    assert len(mesh.uvs) == len(mesh.face_indices)
    assert sum(len(s.faces) for s in mesh.subsets) == len(mesh.face_counts)
    for shape in mesh.shapes:
        dense = np.zeros_like(mesh.points)
        dense[packed[f"idx_{shape.name}"]] = 0.01 * packed[f"off_{shape.name}"]
        np.testing.assert_allclose(
            mesh.offsets_at(np.arange(len(dense)))[mesh.shape_names.index(shape.name)],
            dense,
            atol=1e-7,
        )


def test_a_whole_word_counts_more_than_a_part_of_one(tmp_path):
    obj(tmp_path, "head_rest.obj", POINTS)
    obj(tmp_path, "wrestle.obj", moved(0, 1))
    assert read_shape_folder(tmp_path, METRES)[0].mesh().name == "head_rest"


def test_a_binary_ply_of_triangles_and_quads_says_what_to_do(tmp_path):
    """Blender writes such files; trimesh reads faces of one size only."""
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\n"
    header += "property float y\nproperty float z\nelement face 2\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    points = np.arange(15, dtype="<f4").tobytes()
    faces = [bytes([len(f)]) + np.array(f, "<i4").tobytes() for f in ([0, 1, 2, 3], [1, 4, 2])]
    (tmp_path / "neutral.ply").write_bytes(header.encode() + points + b"".join(faces))
    with pytest.raises(InputError, match="triangles and quads mixed"):
        read_shape_folder(tmp_path, RigOptions())


def test_what_else_the_neutral_has_is_named(tmp_path):
    rows = "".join(f"v {x} {y} {z} 1 0 0\n" for x, y, z in POINTS)
    rest = (
        "vn 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\no a\ns 1\ng a\nf 1/1/1 2/2/1 3/3/1\no b\ng b\n"
        "f 1//1 3//1 4//1\n"
    )
    (tmp_path / "neutral.obj").write_text(f"{rows}{rest}l 1 2\n")
    obj(tmp_path, "smile.obj", moved(2, (0, 0.5, 0)), "f 1 2 3\nf 1 3 4\n")
    _, findings = read_shape_folder(tmp_path, METRES)
    assert [(f.code, f.values["channels"]) for f in findings] == [
        (
            "CHANNEL_IGNORED",
            [
                "colours of points",
                "normals",
                "smoothing groups",
                "points and lines",
                "names of objects",
                "texture coordinates, which some faces lack",
                "groups of faces",
            ],
        )
    ]


def test_properties_of_ply_points_are_named(tmp_path):
    colours = np.full((4, 4), 128, np.uint8)
    faces = [[0, 1, 2], [0, 2, 3]]
    neutral = trimesh.Trimesh(POINTS, faces, vertex_colors=colours, process=False)
    neutral.export(tmp_path / "neutral.ply")
    ply(tmp_path, "smile.ply", moved(2, (0, 0.5, 0)))
    _, findings = read_shape_folder(tmp_path, METRES)
    assert [(f.code, f.values["channels"]) for f in findings] == [
        ("CHANNEL_IGNORED", ["red", "green", "blue", "alpha"])
    ]


def test_meshes_in_folders_below_are_announced(tmp_path):
    for folder in (tmp_path, tmp_path / "brows", tmp_path / ".cache"):
        folder.mkdir(exist_ok=True)
        obj(folder, "up.obj", moved(2, (0, 0.5, 0)))
    obj(tmp_path, "neutral.obj", POINTS)
    rig, findings = read_shape_folder(tmp_path, METRES)
    assert rig.shape_names == ("up",)
    assert [(f.code, f.where, dict(f.values)) for f in findings] == [
        ("SHAPE_SKIPPED", str(tmp_path / "brows"), {"file_count": 1})
    ]
