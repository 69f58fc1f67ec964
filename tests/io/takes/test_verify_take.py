from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError, PluginError
from usdface.findings import finding
from usdface.formats import TakeReader
from usdface.io.format_table import Registered
from usdface.io.takes.verify_take import verified_take
from usdface.takes import MarkerTake, WeightsTake

READER = Registered(
    TakeReader(name="XYZ", suffixes=(".xyz",), read=lambda path, options: ...),  # type: ignore[arg-type,return-value]
    "acme 1.0 (acme:XYZ)",
)
TIMES = np.arange(4) / 10
POSITIONS = np.ones((4, 3, 3))


def take(**changes: object) -> MarkerTake:
    fields = {"names": ("a", "b", "c"), "times": TIMES, "positions": POSITIONS, "rate": 10.0}
    return MarkerTake(**fields | changes)  # type: ignore[arg-type]


def occluded(*places: tuple[object, int]) -> MarkerTake:
    positions = POSITIONS.copy()
    for frames, marker in places:
        positions[frames, marker] = np.nan
    return take(positions=positions)


def test_a_good_take_comes_back_as_it_is() -> None:
    for good in (take(), WeightsTake(("a",), TIMES, np.zeros((4, 1)))):
        found, findings = verified_take(READER, Path("a.xyz"), (good, []))
        assert found is good and findings == []


def test_occlusion_is_announced_once() -> None:
    path = Path("a.xyz")
    given = occluded((0, 1), (slice(None), 2))
    found, findings = verified_take(READER, path, (given, []))
    assert found.names == ("a", "b") and found.positions.shape == (4, 2, 3)
    assert [f.code for f in findings] == ["MARKER_NEVER_SEEN", "MARKER_OCCLUDED"]
    own = finding("MARKER_OCCLUDED", "a.xyz: b", "occluded in 1 of 4 frames")
    _, findings = verified_take(READER, path, (given, [own]))
    assert [f.code for f in findings] == ["MARKER_OCCLUDED", "MARKER_NEVER_SEEN"]
    with pytest.raises(InputError, match="no marker is visible"):
        verified_take(READER, path, (take(positions=np.full((4, 3, 3), np.nan)), []))


def test_a_name_without_letters_is_refused() -> None:
    with pytest.raises(PluginError) as raised:
        verified_take(READER, Path("a.xyz"), (take(names=("a", "b", " ")), []))
    assert "an empty name" in str(raised.value)
    assert "XYZ of acme 1.0 (acme:XYZ)" in str(raised.value)


@pytest.mark.parametrize(
    "given",
    [take(positions=1e12 * POSITIONS), WeightsTake(("a",), TIMES, np.full((4, 1), 1e6))],
)
def test_values_beyond_any_meaning_are_refused(given: MarkerTake | WeightsTake) -> None:
    with pytest.raises(InputError, match=r"a\.xyz: ") as raised:
        verified_take(READER, Path("a.xyz"), (given, []))
    assert raised.value.code == "VALUES_WRONG"


def test_a_take_out_of_proportion_to_its_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    path.write_text("1")
    big = np.zeros((400_000, 2, 3))
    with pytest.raises(InputError) as raised:
        verified_take(READER, path, (MarkerTake(("a", "b"), np.arange(400_000.0), big), []))
    assert raised.value.code == "TOO_LARGE"
