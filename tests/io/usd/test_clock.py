"""Clocks that cannot be, or are absurd, of trusted files, too: one line, or bounded work."""

import re
from pathlib import Path

import pytest
from pxr import Usd
from worlds import make_world

import usdface
from usdface.cli import main
from usdface.errors import InputError

PLACES = ("rig.usda", "take.usda", "shot.usda")


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with rig, take and shot that are opened at once."""
    monkeypatch.setenv("USDFACE_TRUSTED", "1")
    make_world().write(tmp_path)
    rig, take, bind = (tmp_path / name for name in ("rig.usda", "take.usda", "bind.json"))
    usdface.make_shot(rig, take, tmp_path / "shot.usda", bind=bind)
    return tmp_path


def with_clock(place: Path, name: str, clock: str) -> Path:
    """Write a file with another clock, under another name."""
    text, count = re.subn(
        "timeCodesPerSecond = .*", f"timeCodesPerSecond = {clock}", (place / name).read_text()
    )
    assert count == 1
    (place / f"x_{name}").write_text(text)
    return place / f"x_{name}"


@pytest.mark.slow
@pytest.mark.parametrize("clock", ["inf", "-inf", "nan", "0", "-24"])
@pytest.mark.parametrize("name", PLACES)
def test_what_is_no_clock_is_refused(place: Path, name: str, clock: str) -> None:
    with pytest.raises(InputError, match="timeCodesPerSecond is") as caught:
        usdface.check(with_clock(place, name, clock))
    assert caught.value.code == "SETTING_WRONG"
    assert main(["check", "--trusted", str(place / f"x_{name}")]) == 1


@pytest.mark.parametrize("clock", ["1e9", "1e-9"])
def test_an_absurd_clock_makes_no_frames(place: Path, clock: str) -> None:
    for name in PLACES:
        assert main(["check", "--trusted", str(with_clock(place, name, clock))]) == 0
    done = usdface.export_scene(place / "x_shot.usda", place / "a.glb")
    assert done.summary["frames"] <= 40
    take = usdface.make_take(place / "x_take.usda", place / "y.usda")
    assert take.summary["frames"] == 40


@pytest.mark.parametrize("clock", ["inf", "nan", "0"])
def test_the_clock_of_a_layer_below_is_refused(place: Path, clock: str) -> None:
    with_clock(place, "take.usda", clock).replace(place / "take.usda")
    with pytest.raises(InputError, match=r"take.usda: timeCodesPerSecond is"):
        usdface.process(place / "shot.usda")
    with pytest.raises(InputError, match=r"take.usda: timeCodesPerSecond is"):
        usdface.apply(Usd.Stage.Open(str(place / "shot.usda")))


def test_a_range_without_end_is_no_loop(place: Path) -> None:
    text = (place / "rig.usda").read_text()
    text = re.sub("\n    (start|end)TimeCode = .*", "", text)
    ranged = "timeCodesPerSecond = 24\n    startTimeCode = 0\n    endTimeCode = 1e18"
    (place / "rig.usda").write_text(re.sub("timeCodesPerSecond = .*", ranged, text, count=1))
    assert main(["check", "--trusted", str(place / "rig.usda")]) == 0
    assert usdface.export_scene(place / "rig.usda", place / "a.glb").summary["frames"] <= 1
