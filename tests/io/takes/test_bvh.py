import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.io.takes.bvh import read_bvh
from usdface.options import TakeOptions

HEAD = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Neck
  {
    OFFSET 0 10 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 0 0 2
    }
  }
}
MOTION
"""
MOTION = np.random.default_rng(11).uniform(-170, 170, (7, 9))


def bvh_text(motion=MOTION, head=HEAD, frames=None, step="0.0333333"):
    lines = "\n".join(" ".join(f"{v:.6f}" for v in row) for row in motion)
    count = len(motion) if frames is None else frames
    return f"{head}Frames: {count}\nFrame Time: {step}\n{lines}\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.bvh"
        path.write_text(text)
        return read_bvh(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


def test_forward_kinematics_is_the_chain_of_rotations(read):
    take, findings = read(bvh_text())
    assert take.names == ("Hips", "Neck", "Neck_end")
    hips = MOTION[:, :3]
    turn = Rotation.from_euler("ZXY", MOTION[:, 3:6], degrees=True)  # intrinsic, as BVH
    neck = hips + turn.apply([0, 10, 0])
    turn = turn * Rotation.from_euler("YZX", MOTION[:, 6:], degrees=True)
    expected = np.stack([hips, neck, neck + turn.apply([0, 0, 2])], axis=1)
    np.testing.assert_allclose(take.positions, expected / 100, atol=1e-6)
    assert take.rate == 30
    np.testing.assert_array_equal(take.times, np.arange(7) / 30)
    assert codes(findings) == ["UNITS_ASSUMED", "UP_AXIS_ASSUMED"]


def test_a_quarter_turn_is_right_handed(read):
    motion = np.zeros((1, 9))
    motion[0, 3] = 90  # about z
    take, _ = read(bvh_text(motion), units="m")
    np.testing.assert_allclose(take.positions[0, 1], [-10, 0, 0], atol=1e-12)


def test_bones_keep_their_length(read):
    positions = read(bvh_text(), units="m")[0].positions
    np.testing.assert_allclose(np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1), 10)
    np.testing.assert_allclose(np.linalg.norm(positions[:, 2] - positions[:, 1], axis=1), 2)


def test_position_channels_of_a_joint_replace_its_offset(read):
    head = HEAD.replace("3 Yrotation Zrotation Xrotation", "3 Zposition Xposition Xrotation")
    motion = np.zeros((1, 9))
    motion[0, 6:8] = 3, 4
    take, _ = read(bvh_text(motion, head), units="m")
    np.testing.assert_allclose(take.positions[0, 1], [4, 10, 3])


def test_names_are_unique_and_may_hold_blanks(read):
    end = "End Site\n { OFFSET 0 0 2 }\n"
    head = HEAD.replace("JOINT Neck", "JOINT mixamo:Left Eye").replace("End Site", end + "End Site")
    take, findings = read(bvh_text(head=head))
    assert take.names == ("Hips", "Left Eye", "mixamo:Left Eye_end", "mixamo:Left Eye_end_2")
    assert {"LABEL_CHANGED", "LABEL_REPEATED"} <= set(codes(findings))


def test_options_win(read):
    take, findings = read(bvh_text(), units="mm", up_axis="Z", rate=60)
    assert (take.rate, take.meters_per_unit, findings) == (60, 0.001, [])
    np.testing.assert_allclose(take.positions[:, 0, 1], MOTION[:, 2] / 1000, atol=1e-9)


def test_motion_that_ends_early_is_read_and_told(read):
    take, findings = read(bvh_text(frames=12))
    assert len(take.times) == 7
    assert codes(findings)[0] == "FRAMES_MISSING"


def test_more_motion_than_announced_is_read_and_told(read):
    take, findings = read(bvh_text(frames=4))
    assert len(take.times) == 7
    assert codes(findings)[0] == "FRAMES_UNANNOUNCED"
    assert findings[0].values == {"expected_count": 4, "frame_count": 7}


@pytest.mark.parametrize(("numbers", "frames"), [(12, 7), (12, 9), (18, 7), (3, 7), (7, 5)])
def test_rows_of_another_number_of_channels_are_refused(read, numbers, frames):
    """Read as a stream they are frames, too, of other channels."""
    motion = np.random.default_rng(3).uniform(-1, 1, (7, numbers))
    with pytest.raises(InputError, match=f"{numbers} numbers, the hierarchy 9") as raised:
        read(bvh_text(motion, frames=frames))
    assert raised.value.code == "COLUMNS_WRONG"


def test_a_frame_may_be_in_several_rows_and_several_in_one(read):
    for shape in ((21, 3), (1, 63)):
        text = bvh_text(MOTION.reshape(shape), frames=7)
        np.testing.assert_allclose(read(text)[0].positions, read(bvh_text())[0].positions)


@pytest.mark.parametrize("frames", [7, 12])
def test_motion_that_is_cut_off_within_a_frame_is_refused(read, frames):
    whole = bvh_text(frames=frames).rstrip()
    start, last = whole.rindex("\n") + 1, whole.rindex(" ")
    line = whole.count("\n") + 1
    for end in (start + 9, last, len(whole) - 1)[: 2 if frames == 7 else 3]:
        with pytest.raises(InputError, match=rf"line {line}: .* cut off within") as raised:
            read(whole[:end])
        assert raised.value.code == "FILE_CUT_OFF"
    with pytest.raises(InputError, match=f"line {line}: 3 of 9 cells, fewer rows"):
        read(whole[:start] + "1 2 3\n")


def test_numbers_after_the_announced_frames_are_not_read(read):
    take, findings = read(bvh_text() + "1 2 3\n")
    assert len(take.times) == 7
    assert codes(findings)[0] == "FRAMES_UNREAD"


def test_numbers_that_are_none_hide_what_hangs_on_them(read):
    motion = MOTION.copy()
    motion[2, 6] = np.inf
    take, _ = read(bvh_text(motion))
    assert np.argwhere(~take.visible).tolist() == [[2, 2]]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("hello", "not a BVH file"),
        (HEAD, "'Frames:' and 'Frame Time:' are missing"),
        (bvh_text(head=HEAD.replace("}\nMOTION", "\nMOTION")), "open joint"),
        (bvh_text(head="HIERARCHY\nMOTION\n"), "no channels"),
        (bvh_text(head=HEAD.replace("Zrotation", "Wrotation")), "unknown channels"),
        (bvh_text(head=HEAD.replace("OFFSET 0 10 0", "OFFSET 0 ten 0")), "hierarchy .* 'ten'"),
        (bvh_text(head=HEAD.replace("6 X", "9999999999 X")), "breaks off"),
        (bvh_text(head="HIERARCHY\n}\nMOTION\n"), "breaks off"),
        (bvh_text(head="HIERARCHY\nJOINT\nMOTION\n"), "open joint"),
        (bvh_text(np.full((2, 9), np.nan)), "no marker is visible"),
        (bvh_text(MOTION[:0], frames=10**11), "no frames"),
        (bvh_text() + "x", "something else than numbers"),
    ],
)
def test_bad_files_are_refused_in_one_line(read, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_depth_and_size_are_no_trap(read):
    deep = "HIERARCHY\n" + "JOINT a\n{\nOFFSET 1 0 0\nCHANNELS 0\n" * 5000 + "}\n" * 5000
    deep = deep.replace("CHANNELS 0", "CHANNELS 1 Xrotation", 1) + "MOTION\n"
    take, _ = read(bvh_text(np.zeros((2, 1)), deep), units="m")
    assert take.positions[1, -1, 0] == 5000
    with pytest.raises(InputError, match="5000 markers cannot come"):
        read(bvh_text(np.zeros((30_000, 1)), deep))


def test_a_real_rig_of_163_joints(shared_data):
    take, _ = read_bvh(shared_data / "makehuman_cc0/face-poseunits.bvh")
    assert len([name for name in take.names if not name.endswith("_end")]) == 163
    assert take.positions.shape[0] == 60
    assert take.rate == 24
    assert take.visible.all()
