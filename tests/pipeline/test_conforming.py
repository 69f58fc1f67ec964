"""A cut, its takes, and the deliverables that a sequence makes of them."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdSkel
from worlds import make_world

from usdface.cli import main
from usdface.io.usd.take_write import write_take

CUT = """TITLE: reel

001  A010     V     C        01:00:00:06 01:00:00:12 00:00:00:00 00:00:00:06
* FROM CLIP NAME: sq010_0010
002  A020     V     C        02:00:00:20 02:00:01:06 00:00:00:06 00:00:00:16
* FROM CLIP NAME: sq010_0020
003  A030     V     C        05:00:00:00 05:00:00:10 00:00:00:16 00:00:01:02
* FROM CLIP NAME: sq010_0030
"""
SHOW = """
folder = "shots"
[characters.mia]
rig = "rig.usda"
bind = "bind.json"
[performers.anna]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    world = make_world()
    world.write(tmp_path)
    for name, start in (("a010", "01:00:00:00"), ("a020", "02:00:00:00")):
        take = replace(world.take, start_timecode=start, source=f"{name}.trc", rate=30.0)
        write_take(take, tmp_path / f"{name}.usdc")
    (tmp_path / "reel.edl").write_text(CUT)
    (tmp_path / "show.toml").write_text(SHOW)
    return tmp_path


def conform(folder: Path, *options: str) -> int:
    takes = [str(folder / "a010.usdc"), str(folder / "a020.usdc")]
    show = ["--show", str(folder / "show.toml"), "--character", "mia", "--performer", "anna"]
    out = ["-o", str(folder / "reel.json"), "--timecode-rate", "24"]
    return main(["conform", str(folder / "reel.edl"), *takes, *show, *out, *options])


@pytest.mark.parametrize("option", ["--performer", "--character"])
def test_names_that_the_show_file_does_not_have_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    known = {"--performer": "anna", "--character": "mia"}[option]
    assert conform(folder, option, known[:-1] + "x") == 1
    kind = option.removeprefix("--")
    assert f"there is no {kind} '{known[:-1]}x'; did you mean {known}?" in capsys.readouterr().err
    assert not (folder / "reel.json").exists()


@pytest.mark.slow
def test_each_clip_is_delivered_from_its_take(folder: Path) -> None:
    assert conform(folder, "--handles", "2") == 0
    document = json.loads((folder / "reel.json").read_text())
    assert [shot["take"] for shot in document["shots"]] == ["a010.usdc", "a020.usdc"]
    assert document["characters"]["mia"]["rig"] == "rig.usda"
    assert main(["sequence", str(folder / "reel.json"), "--workers", "1"]) == 0
    whole = weights(folder / "shots/sq010_0010.usdface.usda", np.arange(4, 14) * 30 / 24)
    face = Usd.Stage.Open(str(folder / "shots/sq010_0010.face.usdc"))
    assert (face.GetStartTimeCode(), face.GetEndTimeCode()) == (6, 11)
    assert face.GetTimeCodesPerSecond() == 24
    cut = weights(folder / "shots/sq010_0010.face.usdc", np.arange(4.0, 14.0))
    np.testing.assert_allclose(cut, whole, atol=1e-6)


def weights(path: Path, codes: np.ndarray) -> np.ndarray:
    stage = Usd.Stage.Open(str(path))
    found = next(p for p in stage.TraverseAll() if p.IsA(UsdSkel.Animation))
    query = UsdSkel.Cache().GetAnimQuery(UsdSkel.Animation(found))
    return np.array([query.ComputeBlendShapeWeights(code) for code in codes.tolist()])


def test_a_clip_without_a_take_is_a_warning(folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert conform(folder) == 0
    assert "CUT_TAKE_MISSING" in capsys.readouterr().out
    assert conform(folder, "--strict") == 1


def test_a_cut_of_other_takes_is_refused_with_both_timecodes(
    folder: Path, capsys: pytest.CaptureFixture
) -> None:
    text = CUT.replace("01:00:00", "09:00:00").replace("02:00:0", "10:00:0")
    (folder / "reel.edl").write_text(text)
    assert conform(folder) == 1
    printed = capsys.readouterr().err
    assert "begin at 05:00:00 to 10:00:00, the takes at 01:00:00 to 02:00:00 [FRAMES" in printed


def test_the_show_file_is_no_input_and_is_beside_its_model(folder: Path) -> None:
    takes = [str(folder / "a010.usdc")]
    words = ["conform", str(folder / "reel.edl"), *takes]
    assert main([*words, "-o", str(folder / "reel.toml")]) == 1
    elsewhere = str(folder / "shots/reel.json")
    assert main([*words, "--show", str(folder / "show.toml"), "-o", elsewhere]) == 1


def test_a_take_without_timecode_is_refused(folder: Path, capsys: pytest.CaptureFixture) -> None:
    words = ["conform", str(folder / "reel.edl"), str(folder / "take.usda")]
    assert main([*words, "-o", str(folder / "reel.json")]) == 1
    assert "usdface take --start-timecode" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("rate", "start", "options", "told"),
    [
        (120.0, "01:00:00:12", [], True),
        (120.0, "01:00:00:12", ["--timecode-rate", "30"], False),
        (120.0, "01:00:00:00", [], False),
        (60.0, "01:00:00:12", [], False),
    ],
)
def test_timecode_of_more_frames_than_video_has_is_a_guess(
    folder: Path, capsys: pytest.CaptureFixture, rate: float, start: str, options: list, told: bool
) -> None:
    take = replace(make_world().take, start_timecode=start, rate=rate)
    write_take(take, folder / "fast.usdc")
    cut = [str(folder / "reel.edl"), str(folder / "fast.usdc"), "--cut-rate", "24"]
    assert main(["conform", *cut, "-o", str(folder / "fast.json"), *options]) == 0
    printed = capsys.readouterr().out
    assert ("01:00:00:12 taken to count 120 frames a second" in printed) is told
    assert ("RATE_ASSUMED" in printed) is told
