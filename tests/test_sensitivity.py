import builtins
import importlib
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(("factor", "expected"), [(0.5, (1.0, 2)), (2.0, (4.0, 6))])
def test_defaults_and_what_follows_a_constant_are_scaled_with_it(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    factor: float,
    expected: tuple[float, int],
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    sensitivity = importlib.import_module("sensitivity")
    (tmp_path / "made_up.py").write_text(
        "SIZE, COUNT = 2.0, 3\nTWICE = 2 * SIZE\n\ndef size(size=SIZE):\n    return size\n"
    )
    found = []

    def scale(value: object) -> object:
        return sensitivity.scaled(value, factor)

    for name in ("SIZE", "COUNT"):
        with monkeypatch.context() as patch:
            patch.setattr(builtins, sensitivity._SCALE, scale, raising=False)
            patch.setattr(sys, "meta_path", [sensitivity._Finder("made_up", name), *sys.meta_path])
            patch.delitem(sys.modules, "made_up", raising=False)
            found.append(importlib.import_module("made_up"))
            del sys.modules["made_up"]
    sized, counted = found
    assert (sized.size(), sized.SIZE, sized.TWICE / 2) == (expected[0],) * 3
    count, size = counted.COUNT, counted.SIZE
    assert (count, size) == (expected[1], 2.0)


def test_every_constant_of_the_table_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    sensitivity = importlib.import_module("sensitivity")
    for constant in (one for rows in sensitivity.TABLE.values() for one in rows):
        assert sensitivity.value_of(constant)
