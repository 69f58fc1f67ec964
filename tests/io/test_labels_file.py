import json
from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.labels_file import read_labels

HEADER = "take,start_s,end_s,emotion,variant,intensity\n"


def write(folder: Path, text: str, name: str = "labels.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_seconds_variants_and_intensities_are_read(tmp_path):
    text = HEADER + "a.trc,1.2,2.5,anger,open_mouth,0.5\n\nsub/b.trc, 0, 0.8, neutral,,\n"
    one, two = read_labels(write(tmp_path, text))
    assert (one.start, one.end, one.unit) == (1.2, 2.5, "s")
    assert (one.emotion, one.variant, one.intensity) == ("anger", "open_mouth", 0.5)
    assert two.take == tmp_path / "sub" / "b.trc"
    assert (two.variant, two.intensity, two.is_emotion) == ("", 1.0, False)


@pytest.mark.parametrize("word", ["Neutral", "NONE"])
def test_no_emotion_is_one_in_any_spelling(tmp_path: Path, word: str) -> None:
    """Else the rest and speech were learned as emotions."""
    (label,) = read_labels(write(tmp_path, f"{HEADER}a.trc,0,1,{word},,\n"))
    assert label.emotion == word.lower() and not label.is_emotion


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_columns_may_be_parted_as_a_spreadsheet_parts_them(tmp_path, delimiter):
    text = (HEADER + "a.trc,1.2,2.5,anger,open_mouth,0.5\n").replace(",", delimiter)
    commas = read_labels(write(tmp_path, text.replace(delimiter, ",")))
    assert read_labels(write(tmp_path, text, "other.csv")) == commas
    with pytest.raises(InputError, match=r"intensity is '0,5'; .* decimals with a point"):
        read_labels(write(tmp_path, text.replace("0.5", "0,5"), "german.csv"))


def test_frame_indices_say_that_they_are(tmp_path):
    (label,) = read_labels(write(tmp_path, "emotion,take,start_frame,end_frame\njoy,a.c3d,3,9\n"))
    assert (label.start, label.end, label.unit) == (3, 9, "frame")


def test_json_says_the_same(tmp_path):
    entries = [
        {
            "take": "a.trc",
            "start_s": 1,
            "end_s": 2,
            "emotion": "awe",
            "variant": "",
            "intensity": 1,
        },
        {"take": "a.trc", "start_frame": 4, "end_frame": 4, "emotion": "none"},
    ]
    first, second = read_labels(write(tmp_path, json.dumps(entries), "labels.json"))
    assert (first.unit, second.unit) == ("s", "frame")
    assert [first.is_emotion, second.is_emotion] == [True, False]


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("a.trc,1,x,joy,,", "line 2: end_s is 'x'; expected a number"),
        ("a.trc,2,1,joy,,", "line 2: the stretch from 2 to 1"),
        ("a.trc,nan,1,joy,,", "line 2: the stretch"),
        ("a.trc,1,inf,joy,,", "line 2: the stretch"),
        ("a.trc,-1,1,joy,,", "line 2: the stretch"),
        ("a.trc,1,2,joy,,0", "line 2: intensity 0;"),
        ("a.trc,1,2,joy,,50%", r"^(?!.*line 2.*line 2).*line 2: intensity is '50%'; expected a"),
        ("a.trc,1,2,joy,,nan", "line 2: intensity"),
        ("a.trc,1,2,very happy,,", "line 2: emotion 'very happy'"),
        ("a.trc,1,,joy,,", "line 2: no end_s"),
        (",1,2,joy,,", "line 2: no take"),
        ("a.trc,1,2,joy,,1,8", "line 2: 7 cells for 6 columns"),
        (
            "../a.trc,1,2,joy,,",
            r"^(?!.*line 2.*line 2).*line 2: the take .* outside the folder of the labels",
        ),
        ("/etc/passwd,1,2,joy,,", "outside the folder of the labels"),
        ("", "has no labels"),
    ],
)
def test_what_a_line_gets_wrong_is_named(tmp_path, row, message):
    with pytest.raises(InputError, match=message):
        read_labels(write(tmp_path, HEADER + row + "\n"))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("take,start_s,end_s,mood", "unknown column 'mood'"),
        ("take,start_s,end_s", "no column 'emotion'"),
        ("take,emotion", "expected either"),
        ("take,start_s,start_frame,end_s,end_frame,emotion", "expected either"),
        ("take,take,start_s,end_s,emotion", "occurs twice"),
    ],
)
def test_columns_are_checked(tmp_path, header, message):
    with pytest.raises(InputError, match=message):
        read_labels(write(tmp_path, header + "\na,1,2,joy\n"))


def test_a_key_that_occurs_twice_is_refused(tmp_path):
    text = '[{"take": "a.trc", "start_s": 1, "end_s": 2, "emotion": "joy", "emotion": "anger"}]'
    with pytest.raises(InputError, match="'emotion' occurs twice"):
        read_labels(write(tmp_path, text, "labels.json"))


@pytest.mark.parametrize("text", ["{", "{}", "[1]", "[" * 100_000, "[]"])
def test_json_of_another_form_is_refused(tmp_path, text):
    with pytest.raises(InputError):
        read_labels(write(tmp_path, text, "labels.json"))


def test_half_a_frame_is_none(tmp_path):
    text = "take,start_frame,end_frame,emotion\na.trc,1.5,2,joy\n"
    with pytest.raises(InputError, match="whole numbers"):
        read_labels(write(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_labels(tmp_path / "labels.csv")
