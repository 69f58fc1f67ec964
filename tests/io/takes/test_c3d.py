import struct

import ezc3d
import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.c3d import read_c3d
from usdface.options import TakeOptions

RNG = np.random.default_rng(13)
POSITIONS = np.float32(RNG.uniform(-500, 500, (8, 3, 3)))


def c3d_bytes(
    positions=POSITIONS,
    residuals=None,
    order="intel",
    scale=-1.0,
    parameters=(),
    analogs=0,
    first=1,
    frames=None,
    labels=("A", "B", "C"),
):
    """A C3D file after the C3D User Guide, written byte by byte."""
    count, markers, _ = positions.shape
    end = ">" if order == "mips" else "<"
    residuals = np.zeros((count, markers)) if residuals is None else residuals
    points = np.concatenate(
        [positions / max(scale, 1e-9) if scale > 0 else positions, residuals[..., None]], axis=2
    ).reshape(count, -1)
    values = np.concatenate([points, np.full((count, analogs), 77.0)], axis=1)
    announced = count if frames is None else frames
    items = {
        "USED": markers,
        "SCALE": scale,
        "RATE": 100.0,
        "FRAMES": announced,
        "UNITS": ["mm"],
        "LABELS": list(labels),
    } | dict(parameters)
    section = struct.pack("<4B", 0, 0, 1, {"intel": 84, "dec": 85, "mips": 86}[order])
    section += parameter("POINT", -1, None, order)
    for name, value in items.items():
        section += parameter(name, 1, value, order)
    section += bytes(4)
    section += bytes(-len(section) % 512)
    start = 2 + len(section) // 512
    header = struct.pack(
        end + "BB6H", 2, 0x50, markers, analogs, first, min(first + announced - 1, 65535), 0, 0
    )[:12]
    header += encode([scale], order) + struct.pack(end + "HH", start, 1) + encode([100.0], order)
    data = values.astype(end + "i2").tobytes() if scale > 0 else encode(values.ravel(), order)
    return header.ljust(512, b"\0") + section + data


def parameter(name, group, value, order):
    end = ">" if order == "mips" else "<"
    if value is None:
        body = b"\0"
    elif isinstance(value, list):
        width = max(map(len, value))
        body = struct.pack("<bBBB", -1, 2, width, len(value))
        body += b"".join(text.encode().ljust(width) for text in value) + b"\0"
    elif isinstance(value, float):
        body = struct.pack("<bB", 4, 0) + encode([value], order) + b"\0"
    else:
        words = np.atleast_1d(value)
        body = struct.pack("<bBB", 2, 1, len(words)) + words.astype(end + "u2").tobytes() + b"\0"
    return (
        struct.pack("<bb", len(name), group)
        + name.encode()
        + struct.pack(end + "H", len(body) + 2)
        + body
    )


def encode(values, order):
    values = np.asarray(values, np.float32)
    if order == "dec":  # VAX F: exponent two higher, 16-bit words swapped
        words = (values * np.float32(4)).astype("<f4").view("<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(words).tobytes()
    return values.astype(">f4" if order == "mips" else "<f4").tobytes()


@pytest.fixture
def read(tmp_path):
    def read(data, **options):
        path = tmp_path / "take.c3d"
        path.write_bytes(data)
        return read_c3d(path, TakeOptions(**options))

    return read


@pytest.fixture
def written(tmp_path):
    """A path of a file that ezc3d wrote: what it is given besides points is set on it."""

    def write(positions, residuals=None, rate=120.0, analogs=None, **point):
        count, markers, _ = positions.shape
        file = ezc3d.c3d()
        parameters = file["parameters"]["POINT"]
        parameters["RATE"]["value"] = [rate]
        parameters["UNITS"]["value"] = ["mm"]
        parameters["LABELS"]["value"] = [f"m{i}" for i in range(markers)]
        for key, value in point.items():
            file.add_parameter("POINT", key, value)
        file["data"]["points"] = np.concatenate(
            [positions.transpose(2, 1, 0), np.ones((1, markers, count))]
        )
        if residuals is not None:
            file["data"]["meta_points"]["residuals"] = residuals.T[None]
        if analogs is not None:
            file["parameters"]["ANALOG"]["RATE"]["value"] = [rate * analogs.shape[2] / count]
            file["parameters"]["ANALOG"]["LABELS"]["value"] = [
                f"a{i}" for i in range(len(analogs[0]))
            ]
            file["data"]["analogs"] = analogs
        path = tmp_path / "written.c3d"
        file.write(str(path))
        return path

    return write


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("order", ["intel", "dec", "mips"])
@pytest.mark.parametrize(("scale", "error"), [(-1.0, 1e-9), (0.05, 0.05e-3)])
@pytest.mark.parametrize("analogs", [0, 6])
def test_every_byte_order_and_number_format(read, order, scale, error, analogs):
    take, findings = read(c3d_bytes(order=order, scale=scale, analogs=analogs))
    assert take.names == ("A", "B", "C")
    np.testing.assert_allclose(take.positions, POSITIONS / 1000, atol=error)
    np.testing.assert_array_equal(take.times, np.arange(8) / 100)
    assert (take.rate, take.meters_per_unit) == (100, 0.001)
    assert codes(findings) == ["CHANNEL_IGNORED"] * bool(analogs) + ["UP_AXIS_ASSUMED"]


def test_our_writer_is_right_in_the_eyes_of_ezc3d(tmp_path):
    path = tmp_path / "a.c3d"
    path.write_bytes(c3d_bytes())
    points = ezc3d.c3d(str(path))["data"]["points"]
    np.testing.assert_array_equal(points[:3].transpose(2, 1, 0), POSITIONS)


def test_what_ezc3d_writes_is_read(written):
    analogs = RNG.normal(size=(1, 5, 8 * 10))
    residuals = np.zeros((8, 3))
    residuals[2, 1] = -1
    take, findings = read_c3d(written(POSITIONS, residuals, analogs=analogs))
    expected = POSITIONS / 1000.0
    expected[2, 1] = np.nan
    np.testing.assert_allclose(take.positions, expected)
    assert take.rate == 120
    assert codes(findings) == ["CHANNEL_IGNORED", "UP_AXIS_ASSUMED", "MARKER_OCCLUDED"]
    assert findings[0].values["channels"] == ["a0", "a1", "a2", "a3", "a4"]


def test_labels_beyond_255(written):
    take, _ = read_c3d(written(np.float32(RNG.normal(size=(2, 300, 3)))))
    assert take.names == tuple(f"m{i}" for i in range(300))


def test_what_is_occluded(read):
    positions, residuals = POSITIONS.copy(), np.zeros((8, 3))
    residuals[1, 0] = -1
    positions[2, 1] = np.nan
    positions[3, 2], residuals[3, 2] = 0, np.nan
    positions[4, 0] = 0  # a marker at the origin is a marker
    residuals[5, 1] = 300  # a mask of cameras above the residual
    take, _ = read(c3d_bytes(positions, residuals))
    assert np.argwhere(~take.visible).tolist() == [[1, 0], [2, 1], [3, 2]]


@pytest.mark.parametrize(
    ("screen", "up", "found"),
    [("+Z", "Z", []), ("Y", "Y", []), ("-Z", "Z", ["UP_AXIS_ASSUMED"])],
)
def test_the_up_axis_is_the_screens(read, screen, up, found):
    take, findings = read(c3d_bytes(parameters={"Y_SCREEN": [screen]}))
    assert (take.up_axis, codes(findings)) == (up, found)
    if up == "Z":
        np.testing.assert_allclose(take.positions[..., 1], POSITIONS[..., 2] / 1000)


def test_x_up_is_refused_unless_told_better(read):
    data = c3d_bytes(parameters={"Y_SCREEN": ["+X"]})
    with pytest.raises(InputError, match="not supported, X"):
        read(data)
    assert read(data, up_axis="Z")[0].up_axis == "Z"


def test_units(read):
    take, findings = read(c3d_bytes(parameters={"UNITS": ["m"]}), up_axis="Y")
    np.testing.assert_allclose(take.positions, POSITIONS)
    assert findings == []
    take, findings = read(c3d_bytes(parameters={"UNITS": ["?"]}), up_axis="Y")
    assert (take.meters_per_unit, codes(findings)) == (0.001, ["UNITS_ASSUMED"])


def test_prefixes_go_where_labels_stay_unique(read):
    take, findings = read(c3d_bytes(labels=("Ann:A", "Ann:B", "C")))
    assert take.names == ("A", "B", "C")
    assert codes(findings) == ["LABEL_CHANGED", "UP_AXIS_ASSUMED"]


def test_points_without_label_are_named_by_number(read):
    assert read(c3d_bytes(labels=("A", "B")))[0].names == ("A", "B", "marker_3")


def test_times_start_at_the_first_frame_whatever_its_number(read):
    take, findings = read(c3d_bytes(first=500))
    np.testing.assert_array_equal(take.times, np.arange(8) / 100)
    assert take.first_frame == 499
    assert codes(findings) == ["FRAMES_RENUMBERED", "UP_AXIS_ASSUMED"]
    assert findings[0].values["frame_number"] == 500


def test_the_header_speaks_where_a_parameter_is_no_number(read):
    take, _ = read(c3d_bytes(parameters={"SCALE": np.nan, "RATE": np.nan}))
    assert take.rate == 100
    np.testing.assert_allclose(take.positions, POSITIONS / 1000)


def test_a_timecode_is_kept(read):
    given = {"SMPTE_START": ["01:02:03:04"]}
    assert read(c3d_bytes(parameters=given))[0].start_timecode == "01:02:03:04"
    take, findings = read(c3d_bytes(parameters={"TIMECODE": ["none"], "SMPTE": 3.0}))
    assert take.start_timecode == ""
    (lost,) = [f for f in findings if f.code == "CHANNEL_IGNORED"]
    assert lost.values["channels"] == ["POINT:TIMECODE", "POINT:SMPTE"]


def test_more_than_65535_frames(read):
    positions = np.float32(np.arange(70_000)[:, None, None] + [[[0.0, 1, 2]]])
    data = c3d_bytes(positions, labels=("A",), frames=70_000, parameters={"FRAMES": 65535})
    long = {"FRAMES": 65535, "LONG_FRAMES": 70_000.0}
    take, findings = read(c3d_bytes(positions, labels=("A",), frames=70_000, parameters=long))
    assert take.positions[-1, 0, 0] == pytest.approx(69.999)
    assert codes(findings) == ["UP_AXIS_ASSUMED"]
    take, findings = read(data + bytes(-len(data) % 512))
    assert len(take.times) == 70_000
    assert take.positions[-1, 0, 0] == pytest.approx(69.999)
    assert codes(findings) == ["FRAMES_UNANNOUNCED", "UP_AXIS_ASSUMED"]
    assert findings[0].values == {"expected_count": 65535, "frame_count": 70_000}


@pytest.mark.parametrize(
    ("frames", "first"), [(slice(100), 1), (slice(96), 1), (slice(40, 60), 41)]
)
def test_a_part_that_keeps_the_numbers_of_its_recording_is_whole(written, tmp_path, frames, first):
    """As ezc3d cuts and joins recordings of Vicon: it knows nothing of the group TRIAL.

    96 frames fill their last block.
    """
    positions = np.float32(RNG.uniform(-500, 500, (50, 3, 3)))
    file = ezc3d.c3d(str(written(positions)))
    file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [1, 0])
    file.add_parameter("TRIAL", "ACTUAL_END_FIELD", [50, 0])
    file["header"]["points"]["first_frame"] = first - 1
    file["data"]["points"] = np.concatenate([file["data"]["points"]] * 2, axis=2)[:, :, frames]
    for name, values in file["data"]["meta_points"].items():
        file["data"]["meta_points"][name] = np.concatenate([values] * 2, axis=2)[:, :, frames]
    file.write(str(tmp_path / "part.c3d"))
    take, findings = read_c3d(tmp_path / "part.c3d", TakeOptions(up_axis="Y"))
    expected = np.concatenate([positions] * 2)[frames] / 1000
    np.testing.assert_allclose(take.positions, expected, rtol=1e-6)
    assert take.first_frame == first - 1
    assert codes(findings) == ["FRAMES_RENUMBERED"] * (first > 1)


def test_frames_that_a_header_leaves_out_are_told(read):
    positions = np.random.default_rng(2).uniform(-100, 100, (100, 3, 3))
    take, findings = read(c3d_bytes(positions, frames=60))
    assert len(take.times) == 60
    assert codes(findings) == ["FRAMES_UNREAD", "UP_AXIS_ASSUMED"]
    assert "40 more" in findings[0].message


@pytest.mark.parametrize("filling", [bytes(511), b"\x01" * 511, bytes(5000)])
def test_what_fills_the_last_block_up_is_no_frame(read, filling):
    assert codes(read(c3d_bytes() + filling)[1]) == ["UP_AXIS_ASSUMED"]


def test_a_file_closed_early_between_frames_is_read_and_told(read):
    take, findings = read(c3d_bytes(frames=1149))
    assert len(take.times) == 8
    assert "1149" in findings[0].message
    assert codes(findings) == ["FRAMES_MISSING", "UP_AXIS_ASSUMED"]


def test_a_file_cut_off_within_a_frame_is_refused(read):
    with pytest.raises(InputError, match=r"take\.c3d is cut off: .* 8 frames, the file holds 7"):
        read(c3d_bytes()[:-10])


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", r"take\.c3d is empty"),
        (b"hello " * 300, "not a C3D file"),
        (c3d_bytes()[:600], "not a C3D file"),
        (c3d_bytes()[:1024], "no points, or is cut off"),
        (c3d_bytes()[:513] + bytes(3) + c3d_bytes()[516:], "parameter section is missing"),
        (c3d_bytes(frames=60_000)[:-10], "cut off"),
        (c3d_bytes(parameters={"USED": 65535}), "cut off"),
        (c3d_bytes(np.full((3, 3, 3), np.nan)), "no marker is visible"),
    ],
)
def test_bad_files_are_refused_in_one_line(read, data, says):
    with pytest.raises(InputError, match=says) as caught:
        read(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["Optotrak", "Qualisys", "markers_analogs"])
def test_real_files_of_three_vendors_read_as_ezc3d_reads_them(shared_data, name):
    path = shared_data / f"c3d_trc_body/{name}.c3d"
    take, findings = read_c3d(path, TakeOptions(up_axis="Y"))
    theirs = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0) / 1000
    seen = ~np.isnan(theirs[..., 0]).all(axis=0)
    np.testing.assert_allclose(take.positions, theirs[:, seen], rtol=1e-6, atol=1e-9)
    assert take.rate == {"Optotrak": 30, "Qualisys": 200, "markers_analogs": 100}[name]
    assert ("FRAMES_MISSING" in codes(findings)) == (name == "Optotrak")


def test_real_labels_lose_their_subject(shared_data):
    take, findings = read_c3d(shared_data / "c3d_trc_body/markers_analogs.c3d")
    assert "gauche_ext" in take.names
    assert take.up_axis == "Z"
    assert "LABEL_CHANGED" in codes(findings)


@pytest.mark.parametrize("data", [c3d_bytes()[:1024], c3d_bytes(frames=60_000)[:-10]])
def test_a_file_that_is_cut_off_says_so_by_its_code(read, data):
    with pytest.raises(InputError) as raised:
        read(data)
    assert raised.value.code == "FILE_CUT_OFF"


def test_computed_points_are_no_markers(read):
    """As Vicon's files list them: angles and forces beside the markers."""
    listed = (("ANGLES", ["B", ""]), ("FORCES", ["none of these"]))
    take, findings = read(c3d_bytes(parameters=listed))
    assert take.names == ("A", "C")
    np.testing.assert_allclose(take.positions, POSITIONS[:, [0, 2]] / 1000, atol=1e-9)
    assert codes(findings)[0] == "CHANNEL_IGNORED" and "B" in str(findings[0])


def test_analog_channels_and_events_are_announced(tmp_path):
    """As of a microphone, and of the marks that an operator sets."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A", "B", "C"]
    file["data"]["points"] = np.concatenate([POSITIONS.transpose(2, 1, 0), np.ones((1, 3, 8))])
    file["parameters"]["ANALOG"]["RATE"]["value"] = [200.0]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = ["microphone", ""]
    file["data"]["analogs"] = RNG.normal(size=(1, 2, 16))
    file.add_parameter("EVENT", "USED", [2])
    file.add_parameter("EVENT", "LABELS", ["Clap"])
    file.add_parameter("EVENT", "TIMES", np.array([[0, 1], [0.25, 2.5]]))
    file.write(str(tmp_path / "a.c3d"))
    _, findings = read_c3d(tmp_path / "a.c3d", TakeOptions(units="mm", up_axis="Y"))
    assert [f.values["channels"] for f in findings] == [
        ["microphone", "1 without a name"],
        ["Clap at 0.25 s", "event at 62.50 s"],
    ]
