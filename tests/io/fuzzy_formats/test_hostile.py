"""Broken files of rules: a system or one clear line, whatever was done to them."""

import numpy as np
import pytest
from every_term import FORMATS, SYSTEMS

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("data", [b"", b"\n \n", b"\0" * 99, b"\xff\xfe\x80 what", b"%PDF-1.4\n"])
def test_what_is_no_fuzzy_system_is_refused_in_one_line(tmp_path, suffix, data):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    with pytest.raises(InputError) as error:
        read_fuzzy_file(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_any_cut_of_a_file_is_a_system_or_an_error(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS["mamdani"])
    text = path.read_text()
    refused = 0
    for end in range(0, len(text) - 1, 61):
        path.write_text(text[:end])
        try:
            read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 5


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_any_changed_word_is_a_system_or_an_error(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS["mamdani"])
    words = path.read_text().split(" ")
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(60):
        changed = list(words)
        odd = ["nan", "-1e999", "(", "'", "[", ";", "1", "", "1e400", "0x1", "=", ":", "None"]
        changed[rng.integers(len(words))] = str(rng.choice(odd))
        path.write_text(" ".join(changed))
        try:
            read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 20


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
@pytest.mark.parametrize("name", ["mamdani", pytest.param("default", marks=pytest.mark.slow)])
def test_any_splice_into_a_file_is_a_system_or_an_error(tmp_path, suffix, name):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS[name])
    text = path.read_text()
    odd = ["", ";", ":", "(", ")", "'", "[", "\n", "nan", "inf", "-1e999", "RULE", "/*", "#", "= 0"]
    rng = np.random.default_rng(1)
    outcomes = set()
    for _ in range(300):
        at = int(rng.integers(len(text)))
        spliced = text[:at] + odd[rng.integers(len(odd))] + text[at + int(rng.integers(7)) :]
        path.write_text(spliced)
        try:
            system, _ = read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            outcomes.add("refused")
        else:
            answer = evaluate(system.fuzzy, np.zeros((2, len(system.features))))
            assert np.isfinite(answer.outputs).all()
            outcomes.add("read")
    assert outcomes == {"refused", "read"}
