import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.rigs.makehuman import is_makehuman, makehuman_files, read_makehuman
from usdface.options import RigOptions

BASE = """v 9 9 9
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
g helper-skirt
f 1 2 3
g body
f 2 3 4 5
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "base.obj").write_text(BASE)
    (tmp_path / "targets").mkdir()
    target = tmp_path / "targets" / "smile.target"
    # With the byte order mark of some editors.
    target.write_text("# comment\n3 0 .5 0\n0 1 1 1\n", encoding="utf-8-sig")
    # What macOS leaves beside a file on drives of other systems.
    target.with_name("._smile.target").write_bytes(b"\0\5\x16\7Mac OS X")
    return tmp_path


def test_helpers_go_and_targets_follow_their_points(folder):
    rig, findings = read_makehuman(folder)
    mesh = rig.mesh()
    np.testing.assert_allclose(
        mesh.points, 0.1 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    )
    assert list(mesh.face_counts) == [4] and list(mesh.face_indices) == [0, 1, 2, 3]
    assert list(mesh.shapes[0].indices) == [2]  # point 3 of the file, and not the skirt's point 0
    np.testing.assert_allclose(mesh.shapes[0].offsets, [(0, 0.05, 0)])
    (dropped,) = findings
    # Each base mesh has them: a warning would fail every one with --strict.
    assert (dropped.code, dropped.severity) == ("HELPERS_DROPPED", "info")


def test_the_unit_holds_for_the_base_mesh_and_the_targets(folder):
    mesh = read_makehuman(folder, RigOptions(meters_per_unit=0.01))[0].mesh()
    np.testing.assert_allclose(mesh.points[2], (0.01, 0.01, 0))
    np.testing.assert_allclose(mesh.shapes[0].offsets, [(0, 0.005, 0)])


@pytest.mark.parametrize("wanted", ["human", "human.obj"])
def test_the_base_mesh_may_have_another_name(folder, wanted):
    (folder / "base.obj").rename(folder / "human.obj")
    assert is_makehuman(folder)
    rig, _ = read_makehuman(folder, RigOptions(neutral=wanted))
    assert rig.shape_names == ("smile",)
    assert {path.name for path in makehuman_files(folder)} == {"human.obj", "smile.target"}
    (folder / "base.obj").write_text("v 0 0 0\n")  # the one that is named counts
    assert len(read_makehuman(folder, RigOptions(neutral=wanted))[0].mesh().points) == 4


def test_the_folder_of_targets_will_do(folder):
    assert is_makehuman(folder) and is_makehuman(folder / "targets")
    for neutral in ("", "base"):
        rig, _ = read_makehuman(folder / "targets", RigOptions(neutral=neutral))
        assert rig.shape_names == ("smile",)


def test_targets_in_folders_are_named_by_their_path(folder):
    (folder / "targets" / "mouth").mkdir()
    (folder / "targets" / "mouth" / "smile.target").write_text("")
    rig, findings = read_makehuman(folder)
    assert rig.shape_names == ("mouth/smile", "smile")
    assert "SHAPE_EMPTY" in [f.code for f in findings]


def test_without_groups_everything_is_kept(folder):
    (folder / "base.obj").write_text(BASE.replace("g ", "# "))
    rig, findings = read_makehuman(folder)
    assert len(rig.mesh().points) == 5 and findings == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("9 0 0 0\n", "outside 0 to 4"),
        ("-1 0 0 0\n", "outside 0 to 4"),
        ("0 0 0\n", "index and three offsets"),
        ("0 a b c\n", "index and three offsets"),
        ("0 nan 0 0\n", "not a finite number"),
    ],
)
def test_a_damaged_target_is_one_clear_line(folder, text, message):
    (folder / "targets" / "smile.target").write_text(text)
    with pytest.raises(InputError, match=message):
        read_makehuman(folder)


def test_missing_parts_are_named(folder):
    (folder / "base.obj").rename(folder / "human.obj")
    with pytest.raises(InputError, match=r"1 MakeHuman .*base\.obj.*--neutral: human\.obj"):
        read_makehuman(folder)
    with pytest.raises(InputError, match=r"no OBJ mesh 'body'.*--neutral: human\.obj"):
        read_makehuman(folder, RigOptions(neutral="body"))
    (folder / "human.obj").unlink()
    assert is_makehuman(folder)
    with pytest.raises(InputError, match=r"add MakeHuman's base\.obj"):
        read_makehuman(folder)
    (folder / "targets" / "smile.target").unlink()
    with pytest.raises(InputError, match=r"no MakeHuman \.target"):
        read_makehuman(folder)


def test_the_published_base_mesh_keeps_its_body(shared_data):
    rig, findings = read_makehuman(shared_data / "makehuman_cc0")
    mesh = rig.mesh()
    # 13,380 points: what MakeHuman's documentation gives for the body of base mesh hm08.
    assert len(mesh.points) == 13_380 and len(mesh.shapes) == 34
    assert 1.5 < np.ptp(mesh.points[:, 1]) < 1.9  # a human's height in metres
    assert all(len(shape.indices) for shape in mesh.shapes)
    assert [f.code for f in findings] == ["HELPERS_DROPPED"]
