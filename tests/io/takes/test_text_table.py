import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.labels_file import read_labels
from usdface.io.takes.csv_markers import read_csv_markers
from usdface.io.takes.deeplabcut import read_deeplabcut
from usdface.io.takes.files import read_take
from usdface.io.takes.mediapipe import read_mediapipe
from usdface.io.takes.sleap import read_sleap
from usdface.io.takes.text_table import (
    nameless_columns,
    positive,
    read_numbers,
    read_rows,
    read_text,
    refuse_cut_end,
)
from usdface.options import TakeOptions


def test_byte_order_mark_and_latin_1_are_read(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbfMund")
    assert read_text(path) == "Mund"
    path.write_bytes("Stirnhöhe".encode("latin-1"))
    assert read_text(path) == "Stirnhöhe"


@pytest.mark.parametrize(("data", "says"), [(b"", "empty"), (b" \n ", "empty"), (b"a\0b", "text")])
def test_files_that_are_no_text_are_refused(tmp_path, data, says):
    path = tmp_path / "a.csv"
    path.write_bytes(data)
    with pytest.raises(InputError, match=says):
        read_text(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_text(tmp_path / "none.csv")


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_rows_know_their_line(tmp_path, ending):
    rows = read_rows(tmp_path, ending.join(["a, b", "", "1,2"]), ",")
    assert rows == [(1, ["a", "b"]), (3, ["1", "2"])]


def test_an_endless_cell_is_refused(tmp_path):
    with pytest.raises(InputError, match="line 1"):
        read_rows(tmp_path / "a.csv", "x" * 200_000, ",")


def test_columns_come_in_the_order_asked_and_missing_cells_are_nan(tmp_path):
    rows = read_rows(tmp_path, "1,2,3\n4,,6\n7\nNA,null,-1e3\n", ",")
    np.testing.assert_array_equal(
        read_numbers(tmp_path, rows, [2, 0]),
        [[3, 1], [6, 4], [np.nan, 7], [-1000, np.nan]],
    )


@pytest.mark.parametrize("cell", ["-nan(ind)", "nan(snan)", "-1.#IND00", "1.#QNAN"])
def test_nan_as_windows_prints_it_is_a_missing_cell(tmp_path, cell):
    rows = read_rows(tmp_path, f"0,{cell}\n", ",")
    np.testing.assert_array_equal(read_numbers(tmp_path, rows, [0, 1]), [[0, np.nan]])


def test_no_rows_keep_the_width(tmp_path):
    assert read_numbers(tmp_path, [], [0, 1, 2]).shape == (0, 3)


def test_a_wrong_cell_is_named(tmp_path):
    rows = read_rows(tmp_path, "1,2\n3,four\n", ",")
    with pytest.raises(InputError, match="line 2, column 2: 'four'"):
        read_numbers(tmp_path, rows, [0, 1])


def test_columns_without_a_name_count_where_something_is_written():
    header = ["time", "", "A_x", ""]
    rows = [(2, ["0", "", "1", "7"]), (3, ["1", "", "2", "", "", "9"])]
    assert nameless_columns(header, rows) == 2  # the fourth and the sixth
    assert nameless_columns(header, rows[:0]) == 0


def test_only_positive_finite_numbers_count_as_announced():
    assert positive("60.0") == 60
    assert [positive(text) for text in ("", "x", "-1", "0", "nan", "inf")] == [0] * 6


def test_a_decimal_comma_is_named(tmp_path):
    with pytest.raises(InputError, match="line 2, column 2: '1,5' is not a number; write decimals"):
        read_numbers(tmp_path / "a.csv", [(2, ["0", "1,5"])], [0, 1])


@pytest.mark.parametrize("content", [b",", b",,\n;\n", b"\x1c", b" \r\n\x1f\n", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("name", ["take.csv", "take.trc", "labels.csv"])
def test_a_table_in_which_nothing_is_written_is_refused(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    read = read_labels if name == "labels.csv" else read_take
    with pytest.raises(InputError, match=name):
        read(path)


SHORT = {
    read_csv_markers: "time,a_x,a_y,a_z\n0.0,10,20,30\n0.1,11,21,31",
    read_deeplabcut: "scorer,s,s,s\nbodyparts,a,a,a\ncoords,x,y,likelihood\n0,1,2,0.9\n1,1,2,0.9",
    read_mediapipe: "frame,landmark,x,y\n0,0,0.10,0.20\n1,0,0.11,0.21",
    read_sleap: "track,frame_idx,instance.score,a.x,a.y\n,0,0.9,10,20\n,1,0.9,11,21",
}


@pytest.mark.parametrize("reader", SHORT)
def test_a_table_that_is_cut_off_is_refused_with_its_line(tmp_path, reader):
    """The last number that is left may be cut, too: a position that is wrong without a trace."""
    path = tmp_path / "take.csv"
    options = TakeOptions(units="m", up_axis="Y", image_size=(640, 480))
    whole = SHORT[reader]
    path.write_text(whole)
    assert len(reader(path, options)[0].times) == 2
    start = whole.rindex("\n") + 1
    for end in range(start + 2, whole.rindex(",") + 1):
        path.write_text(whole[:end])
        with pytest.raises(InputError, match=r"line \d: \d cells; expected") as raised:
            reader(path, options)
        assert raised.value.code == "FILE_CUT_OFF"


@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize("ending", ["", "\t ", "\n", "\r\n", "\n \t"])
@pytest.mark.parametrize("missing", [False, True])
def test_two_signs_of_three_make_a_cut_row(tmp_path, short, ending, missing):
    cells = ["2", "0.1"] if short else ["2", "0.1", "5"]
    text = "1\t0.0\t4\n" + "\t".join(cells) + ending
    signs = short + (not ending.strip(" \t")) + missing
    if signs < 2:
        refuse_cut_end(tmp_path / "a.trc", text, (2, cells), 3, missing)
        return
    with pytest.raises(InputError, match=r"a\.trc, line 2: .* cut off within this row") as raised:
        refuse_cut_end(tmp_path / "a.trc", text, (2, cells), 3, missing)
    assert raised.value.code == "FILE_CUT_OFF"
