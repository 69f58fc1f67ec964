import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.io.takes.vicon import read_vicon
from usdface.options import TakeOptions

POSITIONS = np.random.default_rng(9).uniform(-300, 300, (4, 2, 3))
EVENTS = [
    ["Events"],
    ["100"],
    ["Subject", "Context", "Name", "Time (s)"],
    ["Face", "Left", "Blink", "0.5"],
]
MODEL = [
    ["Model Outputs"],
    ["100"],
    ["", "", "Face:JawAngles"],
    ["Frame", "Sub Frame", "X", "Y", "Z"],
    ["", "", "deg", "deg", "deg"],
    ["1", "0", "1.0", "2.0", "3.0"],
]
SPEED = ["X'", "Y'", "Z'"]


def trajectories(positions=POSITIONS, first=1, speeds=False, unit="mm"):
    """The section's rows; `speeds` adds those of the second marker."""
    spare = [""] * 3 * speeds
    rows = [
        ["Trajectories"],
        ["120"],
        ["", "", "Face:Chin", "", "", "Face:Nose", "", "", *["Face:Nose", "", ""] * speeds],
        ["Frame", "Sub Frame", *"XYZXYZ", *SPEED * speeds],
        ["", "", *[unit] * 6, *spare],
    ]
    for frame, places in enumerate(positions):
        cells = ["" if np.isnan(v) else repr(float(v)) for v in places.ravel()]
        rows.append([str(first + frame), "0", *cells, *["1.0"] * len(spare)])
    return rows


def text_of(*sections, delimiter=","):
    """Sections with a blank line between them."""
    return "\n\n".join("\n".join(map(delimiter.join, rows)) for rows in sections) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, name="take.csv", **options):
        path = tmp_path / name
        path.write_text(text)
        return read_vicon(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("delimiter", [",", "\t"])
def test_trajectories_are_read_by_name_unit_and_rate(read, delimiter):
    take, findings = read(text_of(trajectories(), delimiter=delimiter))
    assert take.names == ("Chin", "Nose")
    assert (take.rate, take.meters_per_unit, take.first_frame) == (120.0, 0.001, 0)
    np.testing.assert_allclose(take.times, np.arange(4) / 120)
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-12)
    assert codes(findings) == ["LABEL_CHANGED", "UP_AXIS_ASSUMED"]


@pytest.mark.parametrize("name", ["take.csv", "take.txt"])
@pytest.mark.parametrize("first", [trajectories(), MODEL, EVENTS])
def test_the_kind_of_file_is_known_by_its_first_section(tmp_path, name, first):
    path = tmp_path / name
    sections = [first] if first[0] == ["Trajectories"] else [first, trajectories()]
    path.write_text("\n\n" + text_of(*sections, delimiter="," if name == "take.csv" else "\t"))
    take, _ = read_take(path, TakeOptions(up_axis="Z"))
    assert take.names == ("Chin", "Nose") and len(take.times) == 4


def test_other_sections_and_speeds_are_announced(read):
    take, findings = read(text_of(EVENTS, trajectories(speeds=True), MODEL))
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-12)
    (ignored,) = [f for f in findings if f.code == "CHANNEL_IGNORED"]
    speeds = [f"Face:Nose {axis}" for axis in SPEED]
    assert ignored.values["channels"] == ["Events", "Model Outputs", *speeds]


@pytest.mark.parametrize("analog", [True, False])
def test_the_older_form_without_units_is_read(tmp_path, analog):
    rows = [["TRAJECTORIES"], ["120.000000", "Hz"], ["", "Chin", "", "", "Nose"]]
    rows += [["Field #", *"XYZXYZ"]]
    for frame, places in enumerate(POSITIONS):
        rows.append([str(1 + frame), *[repr(float(v)) for v in places.ravel()]])
    forces = [["ANALOG"], ["1080", "Hz"], ["Sample #", "FX1"], ["1", "0.5"]]
    path = tmp_path / "take.csv"
    path.write_text(text_of(*([forces] * analog), rows))
    take, findings = read_take(path)
    assert (take.names, take.rate, take.first_frame) == (("Chin", "Nose"), 120.0, 0)
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-12)
    assert "UNITS_ASSUMED" in codes(findings)
    assert ("CHANNEL_IGNORED" in codes(findings)) == analog


def test_the_older_form_without_frames_is_refused(read):
    with pytest.raises(InputError, match="no frames"):
        read("TRAJECTORIES\n120,Hz\n,Chin,,\nField #,X,Y,Z\n")


def test_a_part_of_a_recording_keeps_the_number_of_its_first_frame(read):
    take, findings = read(text_of(trajectories(first=101)))
    assert take.first_frame == 100 and take.times[0] == 0
    assert codes(findings)[0] == "FRAMES_RENUMBERED"


def test_empty_cells_are_occluded_and_missing_frames_announced(read):
    positions = POSITIONS.copy()
    positions[1, 1] = positions[3, 1] = np.nan
    rows = trajectories(positions)
    rows[-1] = rows[-1][:5]  # left out at the end of the row
    take, findings = read(text_of([*rows[:-2], rows[-1]]))
    assert np.isnan(take.positions[:, 1]).all(axis=1).tolist() == [False, True, True]
    np.testing.assert_allclose(take.times * 120, [0, 1, 3])
    assert {"MARKER_OCCLUDED", "FRAMES_DROPPED"} <= set(codes(findings))


def test_options_go_before_the_file(read):
    take, _ = read(text_of(trajectories()), units="cm", up_axis="Z", rate=60.0)
    assert (take.rate, take.up_axis, take.meters_per_unit) == (60.0, "Z", 0.01)


def test_a_file_without_trajectories_says_which_sections_it_has(read):
    with pytest.raises(InputError, match=r"'Trajectories' is missing; found Events, Model Outputs"):
        read(text_of(EVENTS, MODEL))


@pytest.mark.parametrize("kept", [2, 3, 4])
def test_a_header_that_is_cut_off_is_told(read, kept):
    with pytest.raises(InputError, match="line 1: expected rate, names, the row"):
        read(text_of(trajectories()[:kept]))


def test_a_header_without_units_is_told_and_no_frame_taken_for_them(read):
    rows = trajectories()
    with pytest.raises(InputError, match="and units below 'Trajectories'"):
        read(text_of([*rows[:4], *rows[5:]]))


def test_a_row_that_is_cut_off_is_told(read):
    with pytest.raises(InputError, match="cut off within this row"):
        read(text_of(trajectories())[:-30])


def test_a_position_that_is_cut_short_is_told_by_the_columns_after_it(read):
    text = text_of(trajectories(speeds=True))
    with pytest.raises(InputError, match="8 of 11 cells, no line end"):
        read(text[: text.rindex(",1.0,1.0,1.0") - 3])


def test_columns_that_are_no_places_are_no_markers(read):
    rows = trajectories()
    rows[3][2:] = ["RX", "RY", "RZ"] * 2
    with pytest.raises(InputError, match="no marker has columns X, Y, Z"):
        read(text_of(rows))
