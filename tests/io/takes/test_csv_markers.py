import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.csv_markers import read_csv_markers
from usdface.options import TakeOptions

POSITIONS = np.random.default_rng(7).uniform(-1, 1, (5, 2, 3))


def wide_text(separator="_", positions=POSITIONS, delimiter=",", axes="xyz", first="time"):
    names = [f"{label}{separator}{axis}" for label in ("Chin", "Nose") for axis in axes]
    lines = [[first, *names]]
    for frame, places in enumerate(positions[..., : len(axes)]):
        time = frame if first == "frame" else frame / 25
        lines.append([time, *("" if np.isnan(v) else repr(float(v)) for v in places.ravel())])
    return "\n".join(delimiter.join(map(str, line)) for line in lines) + "\n"


def long_text(axes="xyz", clocks=("frame", "time"), order=slice(None), start=0):
    lines = []
    for frame, places in enumerate(POSITIONS[..., : len(axes)]):
        clock = {"frame": frame + start, "time": frame / 25}
        for label, place in zip(("Chin", "Nose"), places, strict=True):
            lines.append([*(clock[c] for c in clocks), label, *map(float, place)])
    lines = [[*clocks, "marker", *axes], *lines[order]]
    return "\n".join(",".join(map(str, line)) for line in lines) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.csv"
        path.write_text(text)
        return read_csv_markers(path, TakeOptions(**({"units": "m", "up_axis": "Y"} | options)))

    return read


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize(
    "text",
    [
        wide_text("_"),
        wide_text("."),
        wide_text(" "),
        wide_text(":", axes="XYZ"),
        wide_text(delimiter=";"),
        wide_text(delimiter="\t", first="Time (s)"),
        wide_text(first="frame"),
        long_text(),
        long_text(clocks=("frame",)),
        long_text(clocks=("time",)),
        long_text(order=slice(None, None, -1)),
    ],
)
def test_every_table_of_one_take_is_the_same_take(read, text):
    take, findings = read(text, rate=25)
    assert sorted(take.names) == ["Chin", "Nose"]
    np.testing.assert_array_equal(take.select(("Chin", "Nose")), POSITIONS)
    np.testing.assert_allclose(take.times, np.arange(5) / 25)
    assert (take.rate, findings) == (25, [])


def test_the_rate_comes_from_the_time_column(read):
    take, _ = read(wide_text())
    assert take.rate == 25


def test_the_first_frame_is_kept_beside_a_time_column(read):
    for text in (long_text(start=100), long_text(clocks=("frame",), start=100)):
        assert read(text, rate=25)[0].first_frame == 100
    lines = wide_text().splitlines()
    wide = ["frame," + lines[0], *(f"{1001 + i},{line}" for i, line in enumerate(lines[1:]))]
    take, _ = read("\n".join(wide) + "\n")
    assert (take.first_frame, take.rate) == (1001, 25)
    assert read(wide_text())[0].first_frame == 0


def test_a_first_frame_that_is_not_the_recordings_is_told(read):
    """Neutral frames of a binding count from the first frame of the take."""
    for clocks in (("frame", "time"), ("frame",)):
        for start, told in ((0, []), (1, []), (1001, [1001])):
            _, findings = read(long_text(clocks=clocks, start=start), rate=25)
            assert [f.values["frame_number"] for f in findings] == told


@pytest.mark.parametrize("frame", [0, 1])
@pytest.mark.parametrize(("begin", "told"), [(0.0, []), (5.0, [5.0])])
def test_a_part_that_counts_its_own_frames_tells_its_time(read, frame, begin, told):
    rows = [f"{frame + k},{begin + k / 25},A,1,2,{k}" for k in range(3)]
    _, findings = read("\n".join(["frame,time,marker,x,y,z", *rows]) + "\n")
    assert [f.values["seconds"] for f in findings if f.code == "FRAMES_RENUMBERED"] == told


def test_frame_1_may_be_a_step_after_the_start(read):
    _, findings = read("frame,time,A_x,A_y,A_z\n1,0.04,1,2,3\n2,0.08,1,2,3\n")
    assert "FRAMES_RENUMBERED" not in codes(findings)


@pytest.mark.parametrize("header", ["time_ms", "Time [ms]", "timestamp (ms)"])
def test_times_in_milliseconds_are_read(read, header):
    lines = wide_text(first=header).splitlines()
    rows = [f"{40 * k},{line.partition(',')[2]}" for k, line in enumerate(lines[1:])]
    take, findings = read("\n".join([lines[0], *rows]) + "\n")
    np.testing.assert_allclose(take.times, np.arange(5) / 25)
    assert (take.rate, findings) == (25, [])


def test_times_in_milliseconds_are_the_same_to_a_microsecond(read):
    for later, ignored in ((40.0005, []), (40.01, ["times of a frame after its first"])):
        rows = "0,0,A,1,2,3", "1,40,A,1,2,3", f"1,{later},B,1,2,3", "0,0,B,1,2,3"
        _, findings = read("\n".join(["frame,time_ms,marker,x,y,z", *rows]) + "\n")
        assert [n for f in findings for n in f.values.get("channels", [])] == ignored


def test_a_time_that_the_take_does_not_keep_is_told(read):
    """Without frame numbers nothing else says which part of a recording a take is."""
    lines = wide_text().splitlines()
    later = [f"{10 + k / 25},{line.partition(',')[2]}" for k, line in enumerate(lines[1:])]
    take, findings = read("\n".join([lines[0], *later]) + "\n")
    assert take.times[0] == 0
    assert [(f.code, dict(f.values)) for f in findings] == [("FRAMES_RENUMBERED", {"seconds": 10})]


def test_units_and_up_axis_nobody_names_are_announced(read):
    take, findings = read(wide_text(), units=None, up_axis=None)
    assert codes(findings) == ["UNITS_ASSUMED", "UP_AXIS_ASSUMED"]
    assert take.meters_per_unit == 0.001


@pytest.mark.parametrize("text", [wide_text(axes="xy"), long_text(axes="xy")])
def test_without_z_the_take_is_of_an_image(read, text):
    take, findings = read(text, image_size=(1920, 1080))
    np.testing.assert_array_equal(take.positions, POSITIONS[..., :2] * [1, -1])
    assert (take.meters_per_unit, take.image_size, findings) == (1.0, (1920, 1080), [])


def test_positions_that_are_not_there_are_occluded(read):
    holes = POSITIONS.copy()
    holes[1, 0] = np.nan
    for text in (wide_text(positions=holes), "".join(_without(long_text(), 3))):
        take, findings = read(text)
        np.testing.assert_array_equal(take.select(("Chin", "Nose")), holes)
        assert codes(findings) == ["MARKER_OCCLUDED"]


def _without(text, line):
    lines = text.splitlines(keepends=True)
    return lines[:line] + lines[line + 1 :]


def test_other_columns_are_announced(read):
    text = wide_text().replace("\n", ",0.5\n").replace("Nose_z,0.5", "Nose_z,confidence")
    take, findings = read(text)
    np.testing.assert_array_equal(take.positions, POSITIONS)
    assert codes(findings) == ["CHANNEL_IGNORED"]
    assert "confidence" in findings[0].message


def test_rotations_and_the_like_are_no_markers(read):
    names = ["Head_Rotation_x", "Head_Rotation_y", "Head_Rotation_z"]
    text = wide_text().replace("\n", ",10,20,30\n").replace("10,20,30", ",".join(names), 1)
    take, findings = read(text)
    np.testing.assert_array_equal(take.positions, POSITIONS)
    assert [f.values["channels"] for f in findings] == [names]


def test_other_times_within_a_frame_are_announced(read):
    rows = ["0,0,a,1,2,3", "0,0,b,1,2,3", "1,0.02,a,1,2,3", "1,0.03,b,1,2,4"]
    take, findings = read("\n".join(["frame,time,marker,x,y,z", *rows]) + "\n")
    np.testing.assert_array_equal(take.times, [0, 0.02])
    assert [f.values["channels"] for f in findings if f.code == "CHANNEL_IGNORED"] == [
        ["times of a frame after its first"]
    ]


def test_columns_without_a_name_are_announced(read):
    lines = [f"{k}," + line for k, line in enumerate(wide_text().splitlines())]
    lines[0] = lines[0].replace("0,", ",", 1)  # as pandas writes the index
    text = "\n".join([lines[0], *(f"{line},7,8" for line in lines[1:])]) + "\n"
    take, findings = read(text)
    np.testing.assert_array_equal(take.positions, POSITIONS)
    assert [f.values["channels"] for f in findings] == [["3 without a name"]]


def test_a_column_that_comes_again_is_announced(read):
    text = long_text().replace("\n", ",5\n").replace("x,y,z,5", "x,y,z,x")
    take, findings = read(text)
    np.testing.assert_array_equal(take.select(("Chin", "Nose")), POSITIONS)
    assert [f.values["channels"] for f in findings] == [["x"]]


def test_positions_without_a_name_are_announced(read):
    text = long_text() + "0,0,,9,9,9\n0,0,,,,\n1,0.02,,,,\n"
    take, findings = read(text)
    np.testing.assert_array_equal(take.select(("Chin", "Nose")), POSITIONS)
    assert codes(findings) == ["CHANNEL_IGNORED"]
    assert "1 positions without the name" in findings[0].message


def test_frame_numbers_with_gaps_need_a_rate_and_keep_the_gaps(read):
    text = "frame,A_x,A_y,A_z\n10,1,2,3\n11,1,2,3\n14,1,2,3\n"
    take, findings = read(text)
    np.testing.assert_allclose(take.times * take.rate, [0, 1, 4])
    assert codes(findings) == ["FRAMES_RENUMBERED", "RATE_ASSUMED", "FRAMES_DROPPED"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a,b\n1,2\n", "no table of markers"),
        ("time,jawOpen\n0,0.5\n", "columns Timecode .* and BlendShapeCount before them"),
        ("time,A_x,A_y,A_z\n", "no frames"),
        ("time,marker,x,y\n", "no frames"),
        ("marker,x,y,z\nA,1,2,3\n", "needs a column 'frame' or 'time'"),
        ("time,A_x,A_y,A_z,B_x,B_y\n0,1,2,3,4,5\n", "'B' has no column for z"),
        ("time,A_x,A.x,A_y\n0,1,2,3\n", "'A.x' occurs twice"),
        ("time,A_x,A_y\n0,1,one\n", "line 2, column 3: 'one'"),
        ("time,marker,x,y\n0,A,1,2\n0,A,1,2\n", "line 3: .* second position"),
        ("time,marker,x,y\n0,A,1,2\n,A,1,2\n", "line 3: the position has no frame or time"),
        ("time,A_x,A_y\n0,,\n1,,\n", "no marker is visible"),
        ("time,A_x,A_y\n0,1,1\n0,1,1\n", "time does not increase"),
    ],
)
def test_bad_tables_are_refused_in_one_line(read, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_a_long_table_cannot_blow_up(read):
    lines = "".join(f"{i},m{i},1,2\n" for i in range(20_000))
    with pytest.raises(InputError, match="20000 frames of 20000 markers"):
        read("frame,marker,x,y\n" + lines)
