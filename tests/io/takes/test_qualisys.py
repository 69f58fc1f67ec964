import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.io.takes.qualisys import read_qualisys
from usdface.options import TakeOptions

POSITIONS = np.random.default_rng(9).uniform(-300, 300, (4, 5, 3))
NAMES = ("LBrow", "RBrow", "Nose", "Chin", "Lip")
HEADER = {
    "NO_OF_FRAMES": "4",
    "NO_OF_CAMERAS": "8",
    "NO_OF_MARKERS": "5",
    "FREQUENCY": "100",
    "NO_OF_ANALOG": "0",
    "ANALOG_FREQUENCY": "0",
    "DESCRIPTION": "--",
    "TIME_STAMP": "2023-01-02, 10:11:12.345\t123.4",
    "DATA_INCLUDED": "3D",
    "MARKER_NAMES": "\t".join(NAMES),
}


def qualisys_text(
    positions=POSITIONS, before=0, headings=False, null="", first=1, tab="", kinds=False, **header
):
    """A file with `before` columns (frame, time) and perhaps a row of column names."""
    lines = [f"{key}\t{value}" for key, value in (HEADER | header).items()]
    lines += ["TRAJECTORY_TYPES" + "\tMeasured" * 5] * kinds
    if headings:
        axes = [f"{name} {axis}" for name in NAMES for axis in "XYZ"]
        lines.append("\t".join([*["Frame", "Time"][:before], *axes]) + tab)
    for frame, places in enumerate(positions):
        cells = [null if np.isnan(v) else f"{v:.3f}" for v in places.ravel()]
        number = [str(first + frame), f"{(first + frame - 1) / 100:.5f}"][:before]
        lines.append("\t".join([*number, *cells]) + tab)
    return "\r\n".join(lines) + "\r\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "take.tsv"
        path.write_text(text, newline="")
        return read_qualisys(path, TakeOptions(**options))

    return read


def codes(findings):
    return [f.code for f in findings]


@pytest.mark.parametrize("before", [0, 1, 2])
@pytest.mark.parametrize("headings", [False, True])
@pytest.mark.parametrize("tab", ["", "\t"])
@pytest.mark.parametrize("kinds", [False, True])
def test_every_layout_of_the_rows_is_read(read, before, headings, tab, kinds):
    take, findings = read(qualisys_text(before=before, headings=headings, tab=tab, kinds=kinds))
    assert take.names == NAMES
    assert (take.rate, take.meters_per_unit, take.first_frame) == (100.0, 0.001, 0)
    np.testing.assert_allclose(take.times, np.arange(4) / 100)
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-6)
    assert codes(findings) == ["UP_AXIS_ASSUMED"]


@pytest.mark.parametrize("null", ["", "null", "NULL"])
@pytest.mark.parametrize("tab", ["", "\t"])
@pytest.mark.parametrize("before", [0, 2])
def test_markers_are_occluded_where_nothing_is_written(read, null, tab, before):
    positions = POSITIONS.copy()
    positions[:2, 0] = positions[2, 3] = np.nan
    positions[:, 4] = np.nan  # the last one is never seen
    take, findings = read(qualisys_text(positions, before=before, null=null, tab=tab))
    assert take.names == NAMES[:4]
    expected = np.isnan(positions[:, :4]).all(axis=2)
    np.testing.assert_array_equal(np.isnan(take.positions).all(axis=2), expected)
    assert "MARKER_NEVER_SEEN" in codes(findings)


def test_places_at_the_origin_are_occluded(read):
    positions = POSITIONS.copy()
    positions[1, 2] = 0.0
    take, findings = read(qualisys_text(positions))
    assert np.isnan(take.positions[1, 2]).all()
    assert "MARKER_SPIKE" in codes(findings)


@pytest.mark.parametrize("version", ["", "FILE_VERSION\t2.0.0\n"])
def test_the_kind_of_file_is_known_by_its_header(tmp_path, version):
    path = tmp_path / "take.tsv"
    path.write_text(version + qualisys_text())
    take, _ = read_take(path, TakeOptions(up_axis="Z"))
    assert take.names == NAMES


def test_a_part_of_a_recording_keeps_the_number_of_its_first_frame(read):
    take, findings = read(qualisys_text(before=2, first=301))
    assert take.first_frame == 300 and take.times[0] == 0
    assert codes(findings)[0] == "FRAMES_RENUMBERED"


def test_events_and_other_columns_are_announced(read):
    text = qualisys_text(before=2, headings=True).replace("Time\t", "SMPTE\t")
    text = text.replace("MARKER_NAMES", "EVENT\tblink\t2\t0.01\r\nMARKER_NAMES")
    take, findings = read(text)
    (ignored,) = [f for f in findings if f.code == "CHANNEL_IGNORED"]
    assert ignored.values["channels"] == ["SMPTE", "events"]
    np.testing.assert_allclose(take.times, np.arange(4) / 100)


@pytest.mark.parametrize("headings", [False, True])
def test_a_column_of_timecodes_is_no_place(read, headings):
    text = qualisys_text(before=2, headings=headings).replace(
        "Frame\tTime\t", "Frame\tTime\tSMPTE\t"
    )
    for frame in range(4):
        time = f"{frame / 100:.5f}\t"
        text = text.replace(f"\n{frame + 1}\t{time}", f"\n{frame + 1}\t{time}10:11:12:0{frame}\t")
    take, findings = read(text)
    assert take.names == NAMES
    np.testing.assert_allclose(take.positions, POSITIONS * 1e-3, atol=1e-6)
    (ignored,) = [f for f in findings if f.code == "CHANNEL_IGNORED"]
    assert ignored.values["channels"] == ["SMPTE"]


def test_an_external_clock_needs_times_or_a_rate(read):
    assert read(qualisys_text(before=2, FREQUENCY="EXT"))[0].rate == pytest.approx(100)
    assert read(qualisys_text(FREQUENCY="EXT"), rate=50.0)[0].rate == 50


def test_other_counts_than_the_headers_are_told(read):
    text = qualisys_text(NO_OF_FRAMES="9", NO_OF_MARKERS="6")
    assert codes(read(text)[1])[:2] == ["MARKERS_MISCOUNTED", "FRAMES_MISSING"]
    text = qualisys_text(MARKER_NAMES="\t".join(NAMES[:3]))
    take, findings = read(text)
    assert take.names == (*NAMES[:3], "marker_4", "marker_5")
    assert "LABEL_CHANGED" in codes(findings)


def test_rows_that_do_not_fit_the_names_are_refused(read):
    text = qualisys_text(MARKER_NAMES="\t".join([*NAMES, "Ear", "Neck"]))
    with pytest.raises(InputError, match=r"line 11: expected x, y, z of 7 markers.* 15 columns"):
        read(text)


@pytest.mark.parametrize(
    ("kind", "found"), [("2D", "2D data"), ("6D", "6D data"), ("", "a header")]
)
def test_other_data_are_refused(read, kind, found):
    lines = qualisys_text(DATA_INCLUDED=kind).replace("MARKER_NAMES", "BODY_NAMES")
    with pytest.raises(InputError, match=f"expected 3D data; found {found}"):
        read(lines)


def test_a_row_that_is_cut_off_is_told(read):
    with pytest.raises(InputError, match="cut off within this row"):
        read(qualisys_text()[:-30])


def test_a_header_alone_has_no_frames(read):
    with pytest.raises(InputError, match="no frames"):
        read(qualisys_text(POSITIONS[:0], NO_OF_FRAMES="0"))
