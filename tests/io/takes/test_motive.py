import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.motive import read_motive
from usdface.options import TakeOptions

POSITIONS = np.random.default_rng(9).uniform(-1, 1, (4, 2, 3))
ABOUT = {
    "Format Version": "1.23",
    "Take Name": "smile",
    "Capture Frame Rate": "120.000000",
    "Export Frame Rate": "120.000000",
    "Capture Start Time": "2024-05-06 11.59.58.500 PM",
    "Total Exported Frames": "4",
    "Length Units": "Meters",
}


def motive_text(
    positions=POSITIONS,
    timecode=False,
    parent=False,
    kinds=("Marker", "Marker"),
    start=0.0,
    **about,
):
    """A rigid body first (rotation and position), then two markers."""
    about = ABOUT | {key.replace("_", " "): value for key, value in about.items()}
    body = ["Rigid Body"] * 7
    spare = [""] * timecode
    header = [
        [part for pair in about.items() for part in pair],
        [],
        ["", "Type", *spare, *body, *np.repeat(kinds, 3)],
        ["", "Name", *spare, *["Helmet"] * 7, *np.repeat(["Face:Chin", "Face:Nose"], 3)],
        ["", "ID", *spare, *["1"] * 7, *np.repeat(["2", "3"], 3)],
        ["", "", *spare, *["Rotation"] * 4, *["Position"] * 9],
        ["Frame", "Time (Seconds)", *["TimeCode"] * timecode, *"XYZW", *"XYZ" * 3],
    ]
    if parent:
        header.insert(5, ["", "Parent", *spare, *[""] * 13])
    for frame, places in enumerate(positions):
        cells = ["" if np.isnan(v) else repr(float(v)) for v in places.ravel()]
        codes = [f"15:26:46:12.0{frame}"] * timecode
        header.append([frame, f"{start + frame / 120:.6f}", *codes, *[0.5] * 7, *cells])
    return "\n".join(",".join(map(str, line)) for line in header) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.csv"
        path.write_text(text)
        return read_motive(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("timecode", [False, True])
@pytest.mark.parametrize("parent", [False, True])
def test_only_markers_are_read_and_the_rest_is_announced(read, timecode, parent):
    take, findings = read(motive_text(timecode=timecode, parent=parent))
    assert take.names == ("Chin", "Nose")
    np.testing.assert_array_equal(take.positions, POSITIONS)
    np.testing.assert_array_equal(take.times, np.arange(4) / 120)
    assert (take.rate, take.up_axis) == (120, "Y")
    assumed = [] if timecode else ["TIMECODE_ASSUMED"]
    assert codes(findings) == ["CHANNEL_IGNORED", "LABEL_CHANGED", *assumed]
    assert "Rigid Body Helmet Rotation" in findings[0].message


@pytest.mark.parametrize(
    ("name", "metres"),
    [("Millimeters", 1e-3), ("Centimeters", 1e-2), ("Meters", 1), ("Inches", 0.0254)],
)
def test_length_units(read, name, metres):
    take, _ = read(motive_text(Length_Units=name))
    np.testing.assert_allclose(take.positions, POSITIONS * metres)


def test_blank_cells_are_occluded(read):
    positions = POSITIONS.copy()
    positions[2, 1] = np.nan
    take, findings = read(motive_text(positions))
    assert np.argwhere(~take.visible).tolist() == [[2, 1]]
    assert "MARKER_OCCLUDED" in codes(findings)


def test_the_timecode_column_or_the_time_of_day_is_the_start(read):
    assert read(motive_text(timecode=True))[0].start_timecode == "15:26:46:12.00"
    assert read(motive_text())[0].start_timecode == "23:59:58:60"
    # an export that starts two seconds into the capture, beyond midnight
    later = motive_text(start=2.0)
    assert read(later)[0].start_timecode == "00:00:00:60"
    assert read(motive_text(Export_Frame_Rate=""))[0].start_timecode == "23:59:58:60"
    assert read(motive_text(Capture_Start_Time=""))[0].start_timecode == ""


def test_a_subframe_is_a_fraction_of_a_frame(read):
    """Of a take at 120 Hz beside timecode at 30: Y of HH:MM:SS:FF.Y counts from 0 to 3."""
    text = motive_text(timecode=True)
    for frame, code in ((3, "13.2"), (2, "13.1"), (1, "13.0"), (0, "12.3")):
        text = text.replace(f"15:26:46:12.0{frame},", f"15:26:46:{code},")
    assert read(text)[0].start_timecode == "15:26:46:12.750"
    assert read(text.replace(":46:1", ":46;1"))[0].start_timecode == "15:26:46;12.750"


def test_notes_of_a_take_may_hold_commas(read):
    notes = motive_text().replace("Take Name,smile,", "Take Name,smile,Take Notes,a, b and c,")
    take, findings = read(notes)
    assert (take.rate, take.meters_per_unit) == (120, 1)
    assert "UNITS_ASSUMED" not in codes(findings)


def test_the_first_frame_of_a_part_is_kept_and_told(read):
    lines = motive_text(start=2.0).split("\n")
    top = next(k for k, line in enumerate(lines) if line.startswith("Frame,"))
    for k in range(top + 1, len(lines) - 1):
        frame, _, rest = lines[k].partition(",")
        lines[k] = f"{int(frame) + 240},{rest}"
    take, findings = read("\n".join(lines))
    assert take.first_frame == 240
    assert [f.values for f in findings if f.code == "FRAMES_RENUMBERED"] == [{"frame_number": 240}]
    assert read(motive_text())[0].first_frame == 0


def test_columns_without_a_header_are_announced(read):
    lines = motive_text().rstrip().split("\n")
    lines[-1] += ",1,2"
    _, findings = read("\n".join(lines) + "\n")
    (ignored,) = [f.values["channels"] for f in findings if f.code == "CHANNEL_IGNORED"]
    assert ignored[-1] == "2 columns without a header"


def test_fewer_frames_than_announced(read):
    assert "FRAMES_MISSING" in codes(read(motive_text(Total_Exported_Frames="30004"))[1])


def test_more_frames_than_announced(read):
    take, findings = read(motive_text(Total_Exported_Frames="2"))
    assert len(take.times) == 4
    assert "FRAMES_UNANNOUNCED" in codes(findings)


def test_a_last_number_that_is_cut_is_refused(read):
    cut = motive_text(Total_Exported_Frames="30004").rstrip()[:-3]
    with pytest.raises(InputError, match="line 11: no line end, fewer rows") as raised:
        read(cut)
    assert raised.value.code == "FILE_CUT_OFF"
    assert len(read(motive_text().rstrip())[0].times) == 4


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,x\n", "not a Motive export"),
        ("Format Version,1.23\n", "the row 'Frame, Time"),
        ("Format Version,1.23\nFrame,Time (Seconds),X\n", "rows are missing"),
        (motive_text(kinds=("Bone", "Bone Marker")), "no columns of type Marker"),
        (motive_text().replace(",X,Y,Z\n", ",X,Y,W\n"), "'Face:Nose' lacks one"),
        (motive_text(POSITIONS[:0]), "no frames"),
        (motive_text().rstrip().rpartition(",")[0], r"line \d+: \d+ cells; expected"),
        (motive_text(np.full((2, 2, 3), np.nan)), "no marker is visible"),
    ],
)
def test_bad_files_are_refused_in_one_line(read, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(text)
    assert "\n" not in str(caught.value)
