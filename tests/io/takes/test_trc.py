import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.c3d import read_c3d
from usdface.io.takes.trc import read_trc
from usdface.options import TakeOptions

POSITIONS = np.random.default_rng(5).uniform(-100, 100, (6, 3, 3))


def trc_text(positions=POSITIONS, delimiter="\t", units="mm", rate=50.0, labels="ABC", frames=None):
    count, markers, _ = positions.shape
    keys = ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate"]
    values = [rate, rate, count if frames is None else frames, markers, units, rate]
    axes = [f"{axis}{i + 1}" for i in range(markers) for axis in "XYZ"]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", "take.trc"],
        keys,
        values,
        ["Frame#", "Time", *(cell for label in labels for cell in (label, "", ""))],
        ["", "", *axes],
        [],
    ]
    for frame, places in enumerate(positions.reshape(count, 3 * markers)):
        cells = ["" if np.isnan(v) else f"{v:.6f}" for v in places]
        lines.append([frame + 1, f"{frame / 50:.5f}", *cells])
    return "\n".join(delimiter.join(map(str, line)) for line in lines) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.trc"
        path.write_text(text)
        return read_trc(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("delimiter", ["\t", ","])
@pytest.mark.parametrize(("units", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])
def test_what_is_written_is_read(read, delimiter, units, metres):
    take, findings = read(trc_text(delimiter=delimiter, units=units))
    assert take.names == ("A", "B", "C")
    assert take.rate == 50
    np.testing.assert_array_equal(take.times, np.arange(6) / 50)
    np.testing.assert_allclose(take.positions, POSITIONS * metres, atol=1e-6 * metres)
    assert codes(findings) == ["UP_AXIS_ASSUMED"]


def test_frames_may_count_from_0_without_a_line_of_axes(read):
    lines = trc_text().splitlines()
    rows = [f"{n}\t{line.split(chr(9), 1)[1]}" for n, line in enumerate(lines[6:])]
    take, findings = read("\n".join([*lines[:4], *rows]) + "\n")
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-9)
    assert codes(findings) == ["UP_AXIS_ASSUMED"]


def test_the_first_frame_of_a_part_is_kept_and_told(read):
    lines = trc_text().split("\n")
    rows = [line.partition("\t")[::2] for line in lines[5:] if line.strip()]
    body = [f"{int(frame) + 1000}\t{rest}" for frame, rest in rows]
    take, findings = read("\n".join([*lines[:5], *body]) + "\n")
    assert take.first_frame == 1000
    assert take.times[0] == 0
    assert [f.values for f in findings if f.code == "FRAMES_RENUMBERED"] == [{"frame_number": 1001}]
    assert read(trc_text())[0].first_frame == 0


def test_empty_cells_are_occluded_also_at_the_end_of_a_row(read):
    positions = POSITIONS.copy()
    positions[2, 0] = positions[3, 2] = np.nan
    text = "\n".join(line.rstrip("\t") for line in trc_text(positions).split("\n"))
    take, findings = read(text)
    assert np.argwhere(~take.visible).tolist() == [[2, 0], [3, 2]]
    assert codes(findings) == ["UP_AXIS_ASSUMED", "MARKER_OCCLUDED", "MARKER_OCCLUDED"]


def test_fewer_frames_than_announced_are_read_and_told(read):
    take, findings = read(trc_text(frames=652))
    assert len(take.times) == 6
    assert "FRAMES_MISSING" in codes(findings)


def test_more_frames_than_announced_are_read_and_told(read):
    take, findings = read(trc_text(frames=4))
    assert len(take.times) == 6
    assert codes(findings) == ["FRAMES_UNANNOUNCED", "UP_AXIS_ASSUMED"]
    assert findings[0].values == {"expected_count": 4, "frame_count": 6}


@pytest.mark.parametrize("announced", [2, 5])
def test_another_number_of_markers_than_announced_is_told(read, announced):
    text = trc_text().replace("\t6\t3\tmm", f"\t6\t{announced}\tmm")
    take, findings = read(text)
    assert take.names == ("A", "B", "C")
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-9)
    assert codes(findings) == ["MARKERS_MISCOUNTED", "UP_AXIS_ASSUMED"]
    assert findings[0].values == {"expected_count": announced, "marker_count": 3}


@pytest.mark.parametrize("labels", [["A", "", "C"], ["A", "B", ""]])
def test_markers_without_a_label_keep_their_columns(read, labels):
    take, findings = read(trc_text(labels=labels))
    names = tuple(label or f"marker_{k + 1}" for k, label in enumerate(labels))
    assert take.names == names
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-9)
    assert codes(findings) == ["LABEL_CHANGED", "UP_AXIS_ASSUMED"]


@pytest.mark.parametrize(("cells", "columns"), [("\t1.5", 1), ("\tok\tno\tyes", 3)])
def test_cells_behind_the_markers_are_told(read, cells, columns):
    lines = trc_text().splitlines()
    take, findings = read("\n".join([*lines[:-1], lines[-1] + cells]) + "\n")
    assert take.names == ("A", "B", "C")
    assert codes(findings) == ["CHANNEL_IGNORED", "UP_AXIS_ASSUMED"]
    assert list(findings[0].values["channels"]) == [f"column {12 + k}" for k in range(columns)]


@pytest.mark.parametrize("frames", [6, 1590])
def test_a_file_that_is_cut_off_within_a_row_is_refused(read, frames):
    """The last number that is left may be cut, too: a position that is wrong without a trace."""
    whole = trc_text(frames=frames).rstrip()
    start, last = whole.rindex("\n") + 1, whole.rindex("\t")
    ends = range(start + 1, last + 1 if frames == 6 else len(whole) + 1)
    for end in ends:
        with pytest.raises(InputError, match=r"line 12: .*no line end.* cut off") as raised:
            read(whole[:end])
        assert raised.value.code == "FILE_CUT_OFF"
    take, findings = read(whole[:start])
    assert len(take.times) == 5
    assert "FRAMES_MISSING" in codes(findings)


def test_a_short_last_row_is_cut_off_only_where_rows_are_missing(read):
    positions = POSITIONS.copy()
    positions[5, 2] = np.nan
    stripped = trc_text(positions).rstrip() + "\n"
    take, findings = read(stripped)
    assert np.argwhere(~take.visible).tolist() == [[5, 2]]
    assert codes(findings) == ["UP_AXIS_ASSUMED", "MARKER_OCCLUDED"]
    with pytest.raises(InputError, match="line 12: 8 of 11 cells, fewer rows than"):
        read(trc_text(positions, frames=7).rstrip() + "\n")


def test_a_whole_file_needs_no_last_line_end(read):
    assert len(read(trc_text().rstrip())[0].times) == 6


def test_without_units_millimetres_are_assumed(read):
    take, findings = read(trc_text(units=""))
    assert take.meters_per_unit == 0.001
    assert "UNITS_ASSUMED" in codes(findings)


def test_a_unit_that_is_not_known_is_named(read):
    take, findings = read(trc_text(units="furlong"))
    assert take.meters_per_unit == 0.001
    assert "'furlong' is no known unit" in findings[0].message


def test_options_win(read):
    take, findings = read(trc_text(), units="cm", up_axis="Z", rate=25)
    assert (take.rate, take.meters_per_unit, findings) == (25, 0.01, [])
    np.testing.assert_allclose(take.times, np.arange(6) / 25)
    np.testing.assert_allclose(take.positions[..., 1], POSITIONS[..., 2] / 100, atol=1e-7)


@pytest.mark.parametrize("last", [6, 16])
def test_without_a_time_column_frame_numbers_and_the_rate_count(read, last):
    lines = trc_text().split("\n")
    cells = [line.split("\t") for line in lines[6:-1]]
    cells[-1][0] = str(last)
    lines[6:-1] = ["\t".join([c[0], "", *c[2:]]) for c in cells]
    take, findings = read("\n".join(lines))
    np.testing.assert_array_equal(take.times, np.array([0, 1, 2, 3, 4, last - 1]) / 50)
    assert ("FRAMES_DROPPED" in codes(findings)) == (last > 6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("hello\nworld\n", "not a TRC file"),
        ("PathFileType\t4\n", "header is cut off"),
        (trc_text().replace("\tA\t\t\tB\t\t\tC\t\t", "\tA\tB"), "3 markers, line 4 names 2"),
        (trc_text(POSITIONS[:0], frames=10**12), "no frames"),
        (trc_text().replace("0.02000", "0.00000"), "time does not increase at frame 1"),
        (trc_text(np.full((2, 3, 3), np.nan)), "no marker is visible"),
        (trc_text().replace("0.04000", "later"), "line 9, column 2: 'later'"),
    ],
)
def test_bad_files_are_refused_in_one_line(read, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_a_long_line_of_labels_cannot_make_a_large_take(read):
    head = trc_text(POSITIONS[:0], labels="").split("\n")
    head[2] = head[2].replace("3", "")
    head[3] = "Frame#\tTime\t" + "A\t\t\t" * 20_000
    with pytest.raises(InputError, match="damaged"):
        read("\n".join(head) + "\n1\t0" * 20_000)


@pytest.mark.parametrize("name", ["Jaw", "Eyebrows"])
def test_real_trc_and_c3d_of_one_take_agree(shared_data, name):
    trc, _ = read_trc(shared_data / f"animface/{name}.trc")
    c3d, _ = read_c3d(shared_data / f"animface/{name}.c3d")
    assert trc.names == c3d.names
    np.testing.assert_array_equal(trc.times, c3d.times)
    assert np.abs(trc.positions - c3d.positions).max() < 1e-6  # 1e-3 mm


def test_a_real_file_that_stops_early(shared_data):
    take, findings = read_trc(shared_data / "c3d_trc_body/markers.trc")
    assert take.positions.shape == (93, 51, 3)
    assert take.rate == 100
    assert "652" in next(f.message for f in findings if f.code == "FRAMES_MISSING")
    np.testing.assert_allclose(take.positions[0, 0], [0.7337041, 0.0809832, 0.1918668])
