"""Fuzzy systems converted and written by command."""

import json

import numpy as np
import pytest
from every_term import sugeno

from usdface.cli import main
from usdface.fuzzy.inference import evaluate
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.papers import fuzzy_table


def test_the_command_goes_through_all_formats_and_says_what_is_doubtful(tmp_path, capsys):
    system = sugeno()
    place = tmp_path / "a.usda"
    write_fuzzy_file(place, system)
    for suffix in (".fll", ".fis", ".fcl", ".usdc"):
        source, place = place, tmp_path / f"a{suffix}"
        assert main(["fuzzy", "convert", str(source), "-o", str(place), "--format", "json"]) == 0
        printed = json.loads(capsys.readouterr().out)
        codes = {f["code"] for f in printed["findings"]}
        assert {"RULE_FIRES_AT_NEUTRAL", "RULE_OFF"} <= codes
        assert ("MEANING_DIFFERS" in codes) == (suffix != ".usdc")
        assert printed["summary"]["rules"] == len(system.fuzzy.rules)
    assert read_fuzzy_file(place)[0] == system


def test_a_failed_conversion_writes_nothing(tmp_path, capsys):
    source, place = tmp_path / "a.fll", tmp_path / "a.fis"
    source.write_text("Engine: a\nInputVariable: x\n  term: t Spike 1 2\n")
    assert main(["fuzzy", "convert", str(source), "-o", str(place)]) == 1
    assert capsys.readouterr().err.startswith("usdface: a.fll, line 3: the term 'Spike'")
    assert not place.exists()


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll", ".usda"])
def test_the_papers_table_comes_out_of_a_file_of_its_system(tmp_path, capsys, suffix):
    place = tmp_path / f"paper{suffix}"
    assert main(["fuzzy", "paper", "-o", str(place), "--format", "json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    fires = [
        f["values"]["rule"] for f in printed["findings"] if f["code"] == "RULE_FIRES_AT_NEUTRAL"
    ]
    assert len(fires) == 1 and "THEN anger IS 1" in fires[0]
    system, findings = read_fuzzy_file(place)
    assert findings == []
    table = fuzzy_table(system.fuzzy)
    assert table.rms < 0.009 and table.largest < 0.041
    assert evaluate(system.fuzzy, np.zeros((1, 13))).outputs[0].tolist() == [0, 0, 1, 0, 0, 0]
