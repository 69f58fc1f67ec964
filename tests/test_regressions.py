import importlib
import json
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def regressions(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("regressions")


def test_only_figures_that_differ_new_or_gone_are_told(regressions: ModuleType) -> None:
    kept = {"solve": {"same": 1.0, "worse": 1.0, "gone": 0.5}, "not measured": {"any": 1.0}}
    now = {"solve": {"same": 1.019, "worse": 1.021, "zero": 0.0}}
    assert list(regressions.differences(kept, now)) == [
        ("solve", "worse", "1", "1.021"),
        ("solve", "gone", "0.5", ""),
        ("solve", "zero", "", "0"),
    ]


def test_what_is_kept_is_what_was_measured(regressions: ModuleType) -> None:
    now = {"solve": {"small": 1.23456e-5, "zero": 0.0, "large": 1234567.0}}
    kept = json.loads(json.dumps(regressions.rounded(now)))
    assert kept["solve"] == {"small": 1.235e-5, "zero": 0.0, "large": 1235000.0}
    assert list(regressions.differences(kept, now)) == []


def test_every_measure_exists_and_has_figures_to_compare_with(regressions: ModuleType) -> None:
    kept = json.loads(regressions.KEPT.read_text(encoding="utf-8"))
    assert sorted(regressions.MEASURES) == sorted(kept)
    for measure in regressions.MEASURES:
        file, function = measure.split(":")
        source = (ROOT / "benchmarks" / f"{file}.py").read_text(encoding="utf-8")
        assert f"\ndef {function}(" in source
        assert kept[measure]
