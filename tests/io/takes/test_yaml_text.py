"""YAML as programs for camera calibration write it."""

import math
from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.takes.yaml_text import read_yaml


def written(folder: Path, text: str) -> Path:
    path = folder / "rig.yml"
    path.write_text(text)
    return path


def test_opencv_writes_a_first_line_and_tags_of_its_own(tmp_path):
    text = (
        '%YAML:1.0\n---\nimage_Width: 640\ntime: "Tue 1 Dec"\nK: !!opencv-matrix\n   rows: 1\n'
        "   cols: 3\n   dt: d\n   data: [ 1.0e+03, 0.,\n       -3.25e-02 ]\nbad: [ .Nan, -.Inf ]\n"
    )
    found = read_yaml(written(tmp_path, text))
    assert found["image_Width"] == 640
    assert found["K"] == {"rows": 1, "cols": 3, "dt": "d", "data": [1000, 0, -0.0325]}
    assert math.isnan(found["bad"][0])
    assert found["bad"][1] == -math.inf


def test_python_writes_numbers_that_yaml_takes_for_texts(tmp_path):
    assert read_yaml(written(tmp_path, "K: [1e-05, -2E3]\n")) == {"K": [1e-05, -2000]}


def test_names_stay_texts(tmp_path):
    """By YAML 1.1 no is False, and 0 a number; what stands in quotes is none either."""
    text = "0: {name: no, serial: '0012'}\n1:\n"
    assert read_yaml(written(tmp_path, text)) == {"0": {"name": "no", "serial": "0012"}, "1": None}


def test_brackets_over_many_lines_are_one_value(tmp_path):
    text = 'size: [\n  640, # width\n  480\n]\n"K 1" : {a: 1,\n  b: [2, 3]}\n'
    assert read_yaml(written(tmp_path, text)) == {"size": [640, 480], "K 1": {"a": 1, "b": [2, 3]}}


@pytest.mark.parametrize(
    ("text", "words", "code"),
    [
        ("K: [1, 2", "line 1: the file ends within a value; copy it again", "FILE_CUT_OFF"),
        ("K: 'x", "line 1: the file ends within a value", "FILE_CUT_OFF"),
        ("a: 1\nK: ]", "line 2: while parsing a block node", "SCHEMA_BROKEN"),
        ("a: 1\nb: {c: 1, c: 2}\n", "line 2: 'c' occurs twice; keep one of them", "SCHEMA_BROKEN"),
        ("? [1]\n: 2\n", "line 1: a key that is no text", "SCHEMA_BROKEN"),
        ("a: &x [1]\nb: *x\n", "line 2: an alias; write its value in its place", "SCHEMA_BROKEN"),
        ("a: \x07", "is no YAML: ", "SCHEMA_BROKEN"),
        ("a: " + "[" * 10_000, "levels nested too deeply", "SCHEMA_BROKEN"),
        ("".join(" " * n + "a:\n" for n in range(1_000)), "nested too deeply", "SCHEMA_BROKEN"),
        (
            "a: 1\n---\nb: 2\n",
            "line 2: expected a single document in the stream but found",
            "SCHEMA_BROKEN",
        ),
    ],
)
def test_anything_else_is_one_clear_line(tmp_path, text, words, code):
    with pytest.raises(InputError) as raised:
        read_yaml(written(tmp_path, text))
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)
    assert raised.value.code == code


def test_aliases_do_not_grow_into_any_number_of_values(tmp_path):
    lines = ["a0: &a0 [1, 1]"] + [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 64)]
    with pytest.raises(InputError, match="line 2: an alias"):
        read_yaml(written(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize("escape", ["UFFFFFFFF", "U00110000"])
def test_an_escape_of_no_character_is_no_yaml(tmp_path, escape):
    with pytest.raises(InputError, match="is no YAML"):
        read_yaml(written(tmp_path, f'a: "\\{escape}"\n'))
