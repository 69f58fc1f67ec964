import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.io.takes.livelink import read_livelink
from usdface.options import TakeOptions

NAMES = ("EyeBlinkLeft", "JawRight", "JawLeft", "TongueOut")
ROTATIONS = ("HeadYaw", "HeadPitch", "HeadRoll", "LeftEyeYaw")


def timecode(seconds, base):
    whole = int(seconds + 1e-9)
    frames = (seconds - whole) * base
    clock = whole % 86400
    return f"{clock // 3600:02d}:{clock // 60 % 60:02d}:{clock % 60:02d}:{abs(frames):06.3f}"


def livelink_text(seconds, base=60, names=NAMES, empty=()):
    lines = [["Timecode", "BlendShapeCount", *names, *ROTATIONS]]
    for row, time in enumerate(seconds):
        values = [0.01 * row + 0.1 * column for column in range(len(names))]
        values += [0.001 * (row % 100 + column) for column in range(len(ROTATIONS))]
        data = ["0"] if row in empty else [str(len(values)), *map(repr, values)]
        lines.append([timecode(time, base), *data])
    return "\n".join(",".join(line) for line in lines) + "\n"


GOOD = livelink_text(np.arange(90) / 30)
ROWS = GOOD.rstrip().split("\n")[1:]


def with_cell(line, name, value, text=GOOD):
    """The text with another value in a line of the file, from 1."""
    lines = text.split("\n")
    cells = lines[line - 1].split(",")
    cells[lines[0].split(",").index(name)] = value
    lines[line - 1] = ",".join(cells)
    return "\n".join(lines)


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.csv"
        path.write_text(text)
        return read_livelink(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


def test_columns_go_by_name(read):
    take, findings = read(livelink_text(100 + np.arange(90) / 30))
    assert take.names == ("eyeBlinkLeft", "jawRight", "jawLeft", "tongueOut")
    np.testing.assert_allclose(take.column("jawLeft"), 0.2 + 0.01 * np.arange(90))
    assert take.start_timecode == "00:01:40:00.000"
    assert codes(findings) == ["CHANNEL_IGNORED"]
    assert findings[0].values["channels"] == ["LeftEyeYaw"]


def test_columns_without_a_name_are_announced(read):
    text = "\n".join(f"{line},7" if k else line for k, line in enumerate(GOOD.split("\n")[:-1]))
    _, findings = read(text + "\n")
    assert ["1 columns without a name"] in [f.values.get("channels") for f in findings]


def turned(yaw=0.0, pitch=0.0, roll=0.0):
    """The text of three rows: at rest, turned by these angles, and at rest again."""
    text = GOOD.split("\n", 4)
    text = "\n".join(text[:4]) + "\n"
    for line in (2, 3, 4):
        for name, angle in zip(ROTATIONS, (yaw, pitch, roll), strict=False):
            text = with_cell(line, name, repr(angle if line == 3 else 0.0), text)
    return text


@pytest.mark.parametrize(
    ("angles", "ahead", "top"),
    [
        ({"yaw": 0.3}, (1, 0), (0, 0)),  # the face turns to its left, which is +x
        ({"pitch": 0.3}, (0, 1), (0, -1)),  # up
        ({"roll": 0.3}, (0, 0), (-1, 0)),  # the top of the head to its right shoulder
    ],
)
def test_the_head_turns_to_its_left_up_and_to_its_right_shoulder(read, angles, ahead, top):
    take, _ = read(turned(**angles))
    turn = Rotation.from_rotvec(take.head[1].copy())
    np.testing.assert_allclose(take.head[[0, 2]], 0.0, atol=1e-15)
    np.testing.assert_array_equal(np.sign(turn.apply([0, 0, 1])[:2].round(9)), ahead)
    up = turn.apply([0, 1, 0])
    np.testing.assert_array_equal(np.sign(up[[0, 2]].round(9)), top)
    assert turn.magnitude() == pytest.approx(0.3)


def test_eyes_that_stay_on_the_phone_turn_against_the_head(read):
    """So the angles of the head have other signs than those of the eyes, whose gaze is known."""
    turn = Rotation.from_rotvec(read(turned(yaw=0.3))[0].head[1].copy())
    gaze = Rotation.from_euler("y", -0.3).apply([0, 0, 1])  # recorded as LeftEyeYaw 0.3: right
    np.testing.assert_allclose(turn.apply(gaze), [0, 0, 1], atol=1e-12)


def test_a_head_that_was_not_recorded_stays_still(read):
    take, findings = read(turned())
    assert take.head is None
    still, unread = findings[:2]
    assert still.values["channels"] == list(ROTATIONS[:3]) and "0 in every row" in still.message
    assert unread.values["channels"] == list(ROTATIONS[3:]) and "not read" in unread.message
    header, *rest = turned(yaw=0.2).split("\n")
    take, findings = read("\n".join([header.replace("HeadRoll", "HeadTilt"), *rest]))
    assert take.head is None and "HeadYaw" in findings[0].values["channels"]


def test_an_angle_that_is_missing_is_bridged(read):
    text = with_cell(3, "HeadPitch", "", with_cell(4, "HeadYaw", "0.4", turned(yaw=0.1)))
    take, findings = read(text)
    np.testing.assert_allclose(take.head[1], [0.0, 0.2, 0.0], atol=1e-12)
    (found,) = (each for each in findings if each.code == "WEIGHT_BRIDGED")
    assert found.values["lines"] == [3] and found.where.endswith(": head")


def test_degrees_and_a_column_that_comes_twice_are_no_head(read):
    take, findings = read(turned(yaw=20.0))
    assert take.head is None
    assert any(f.values.get("angle") == 20.0 and f.code == "CHANNEL_IGNORED" for f in findings)
    with pytest.raises(InputError, match="two columns HeadYaw"):
        read(turned(yaw=0.2).replace("LeftEyeYaw", "HeadYaw"))


@pytest.mark.parametrize(
    ("base", "rate"), [(60, 60), (60, 30), (30, 30), (30, 60), (24, 24), (25, 25), (60, 20)]
)
@pytest.mark.parametrize("start", [0.0, 3725.4])
def test_the_rate_is_found_whatever_the_timecode_counts(read, base, rate, start):
    seconds = start + np.arange(4 * rate) / rate
    take, findings = read(livelink_text(seconds, base))
    assert take.rate == rate
    np.testing.assert_allclose(take.times, seconds - seconds[0], atol=1e-4)
    assert codes(findings) == ["CHANNEL_IGNORED"]


def test_a_take_within_one_second_is_read_as_sixtieths_and_says_so(read):
    take, findings = read(livelink_text(10 + np.arange(10) / 30))
    assert (take.rate, codes(findings)) == (30, ["CHANNEL_IGNORED", "RATE_ASSUMED"])


def test_dropped_frames_stay_gaps(read):
    seconds = np.delete(np.arange(100) / 30, [40, 41, 70])
    take, findings = read(livelink_text(seconds))
    np.testing.assert_allclose(take.times, seconds, atol=1e-4)
    assert codes(findings) == ["CHANNEL_IGNORED", "FRAMES_DROPPED"]
    assert findings[1].message.startswith("3 frames")


@pytest.mark.parametrize("base", [30, 60])
def test_drop_frame_timecode_leaves_out_numbers_not_frames(read, base):
    numbers = np.arange(8 * 60 * base, 11 * 60 * base)  # over minutes 9, 10 and 11
    kept = [n for n in numbers if n % (60 * base) >= base // 15 or n // (60 * base) % 10 == 0]
    text = livelink_text(np.array(kept) / base, base)
    take, findings = read(re.sub(r":(\d\d\.\d+)", r";\1", text))
    assert take.rate == pytest.approx(base / 1.001)
    np.testing.assert_allclose(take.times, np.arange(len(kept)) * 1.001 / base, atol=1e-4)
    assert codes(findings) == ["CHANNEL_IGNORED"]


def test_rows_of_a_lost_face_are_left_out(read):
    seconds = np.arange(90) / 30
    take, findings = read(livelink_text(seconds, empty=(0, 50, 51)))
    kept = np.delete(seconds, [0, 50, 51])
    np.testing.assert_allclose(take.times, kept - kept[0], atol=1e-4)
    assert take.start_timecode == "00:00:00:02.000"
    expected = ["FRAME_EMPTY", "FRAMES_RENUMBERED", "CHANNEL_IGNORED", "FRAMES_DROPPED"]
    assert codes(findings) == expected
    assert "3 of 90" in findings[0].message and "row 2 of" in findings[1].message
    _, findings = read(livelink_text(seconds, empty=(50,)))
    assert codes(findings)[:2] == ["FRAME_EMPTY", "CHANNEL_IGNORED"]  # the first has its time


@pytest.mark.parametrize("missing", ["", "NaN", "null", "inf"])
def test_a_missing_weight_is_bridged_in_its_own_curve(read, missing):
    text = livelink_text(np.delete(np.arange(91) / 30, 40))  # one step of two frames
    text = with_cell(41, "JawLeft", missing, text)
    whole, _ = read(livelink_text(np.delete(np.arange(91) / 30, 40)))
    take, findings = read(text)
    np.testing.assert_array_equal(take.times, whole.times)
    before, after = whole.column("jawLeft")[[38, 40]]
    expected = whole.weights.copy()
    expected[39, 2] = before + (after - before) / 3  # a third of the time on
    np.testing.assert_allclose(take.weights, expected, atol=1e-9)
    assert codes(findings) == ["CHANNEL_IGNORED", "WEIGHT_BRIDGED", "FRAMES_DROPPED"]
    assert findings[1].values == {"lines": [41]}
    assert findings[1].where.endswith("take.csv: jawLeft")


def test_missing_weights_at_the_ends_are_held(read):
    text = with_cell(91, "JawLeft", "", with_cell(2, "JawLeft", "", with_cell(3, "JawLeft", "")))
    take, findings = read(with_cell(2, "TongueOut", "", text))
    assert take.column("jawLeft")[[0, 1, 2, -2, -1]] == pytest.approx([0.22] * 3 + [1.08] * 2)
    bridged = {f.where.split()[-1]: f.values["lines"] for f in findings if f.severity == "warning"}
    assert bridged == {"jawLeft": [2, 3, 91], "tongueOut": [2]}


@pytest.mark.parametrize(("missing", "kept"), [(90, False), (50, False), (40, True)])
def test_a_curve_of_which_most_weights_are_missing_is_left_out(read, missing, kept):
    lines = [
        ",".join([*line.split(",")[:3], "", *line.split(",")[4:]]) if n < missing else line
        for n, line in enumerate(ROWS)
    ]
    take, findings = read("\n".join([GOOD.split("\n")[0], *lines]))
    assert ("jawRight" in take.names) == kept and len(take.names) == 3 + kept
    assert take.weights.shape == (90, 3 + kept)
    left_out = "more than half of the rows have no weight of JawRight"
    assert (findings[0].message == left_out) != kept


def test_a_file_of_which_most_weights_are_missing_is_refused(read):
    """Each row has a weight, of another curve than its neighbours."""
    lines = []
    for n, line in enumerate(ROWS):
        cells = line.split(",")
        lines.append(
            ",".join(
                c if i not in range(2, 6) or i == 2 + n % 4 else "" for i, c in enumerate(cells)
            )
        )
    with pytest.raises(InputError, match="no curve has weights in half of the rows"):
        read("\n".join([GOOD.split("\n")[0], *lines]))


@pytest.mark.parametrize("cells", [3, 5, 6, 9])
def test_a_file_that_is_cut_off_within_a_row_is_refused(read, cells):
    last = ",".join(ROWS[-1].split(",")[:cells])
    with pytest.raises(InputError, match=f"line 91: {cells} cells; expected 10") as raised:
        read(GOOD[: GOOD.rstrip().rindex("\n") + 1] + last)
    assert raised.value.code == "FILE_CUT_OFF"


def test_a_take_may_run_over_midnight(read):
    take, findings = read(livelink_text(86398.5 + np.arange(90) / 30))
    np.testing.assert_allclose(take.times, np.arange(90) / 30, atol=1e-4)
    assert codes(findings) == ["CHANNEL_IGNORED"]


def test_the_rate_of_the_options_stretches_the_times(read):
    take, _ = read(livelink_text(np.arange(90) / 30), rate=60)
    assert take.rate == 60
    np.testing.assert_allclose(take.times, np.arange(90) / 60, atol=1e-4)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,x\n", "not a Live Link Face file"),
        ("Timecode,BlendShapeCount,HeadYaw\n", "no blend shape columns"),
        (GOOD.split("\n")[0] + "\n", "no row has"),
        (livelink_text(np.arange(3) / 30, empty=(0, 1, 2)), "no row has"),
        (GOOD.replace("00:00:01:00.000", "1 o'clock"), "line 32: .* not a timecode"),
        (GOOD.replace("00:00:01:00.000", "00:00:00:00.000"), "time does not increase"),
        (GOOD.replace("00:00:01:00.000", "00:00:01:500.0"), "more than a second holds"),
        (livelink_text([0.0], names=("JawOpen", "jawOpen")), "'jawOpen' occurs twice"),
        (GOOD.replace(",0.31,", ",much,"), "'much' is not a number"),
        (with_cell(51, "JawLeft", "x1"), "line 51, column 5: 'x1' is not a number"),
    ],
)
def test_bad_files_are_refused_in_one_line(read, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_a_real_range_of_motion(shared_data):
    path = shared_data / "livelinkface/alex_rom_3.csv"
    take, findings = read_livelink(path)
    assert take.weights.shape == (4030, 52)
    assert take.rate == 30
    assert take.start_timecode == "13:13:04:31.652"
    assert take.times[-1] == pytest.approx(134.3818, abs=1e-3)
    assert take.names.index("jawRight") < take.names.index("jawLeft")
    assert (take.weights.max(axis=0) > 0.3).sum() == 50
    assert codes(findings) == ["CHANNEL_IGNORED", "CHANNEL_IGNORED", "FRAMES_DROPPED"]
    assert np.sum(np.diff(take.times) > 1.5 / 30) == 3
