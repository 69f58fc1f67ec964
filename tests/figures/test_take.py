from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import make_world

from usdface.cli import main
from usdface.figures.take import write_take_figure
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.pipeline import make_shot
from usdface.shot.report import report_of
from usdface.shot.retarget import retarget
from usdface.shot.shot import ShotResult

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    world = make_world(head_moves=False)
    folder = world.write(tmp_path_factory.mktemp("face"))
    files = (folder / "rig.usda", folder / "take.usda", folder / "shot.usda")
    make_shot(*files, bind=folder / "bind.json")
    return folder / "shot.usda"


@pytest.fixture(scope="module")
def solved(shot: Path) -> ShotResult:
    stage = open_stage(shot)
    return retarget(read_shot(stage, "shot")[0].shot)


@pytest.mark.slow
def test_process_draws_the_take_and_the_same_take_the_same(shot: Path, tmp_path: Path) -> None:
    drawn = []
    for name in ("one.png", "two.png"):
        assert main(["process", str(shot), "--figure", str(tmp_path / name)]) == 0
        drawn.append((tmp_path / name).read_bytes())
    assert drawn[0].startswith(PNG) and len(drawn[0]) > 20_000
    assert drawn[0] == drawn[1]


@pytest.mark.slow
def test_the_regions_and_the_largest_weights_are_named(solved: ShotResult, tmp_path: Path) -> None:
    path = tmp_path / "take.svg"
    details = report_of(solved).details
    write_take_figure(solved, details, path)
    text = path.read_text()
    regions = details["residual"]["regions_mm"]
    for region, entry in regions.items():
        assert f"{region} {entry['rms']:.2f}" in text
    assert "jawOpen" in text


@pytest.mark.slow
def test_what_is_not_there_is_not_drawn(solved: ShotResult, tmp_path: Path) -> None:
    """A take of weights has no residual, an uncorrected one no emotions, a still one no weights."""
    still = replace(solved.solved, weights=np.zeros_like(solved.solved.weights))
    bare = replace(solved, corrected=None, trace=None, solved=still)
    write_take_figure(bare, {}, tmp_path / "bare.svg")
    text = (tmp_path / "bare.svg").read_text()
    assert "no weight moves" in text and "RMS [mm]" not in text and "emotions" not in text
    assert "standard deviation" not in text
    write_take_figure(replace(bare, solved=solved.solved), {}, tmp_path / "recorded.svg")
    text = (tmp_path / "recorded.svg").read_text()
    assert "<!-- solved weights that move" in text and "<!-- weight -->" in text
    assert "standard deviation" not in text


def test_a_file_that_is_no_picture_is_refused_before_any_work(shot: Path, tmp_path: Path) -> None:
    result = tmp_path / "result.usda"
    wanted = ["process", str(shot), "-o", str(result), "--figure", str(tmp_path / "take.txt")]
    assert main(wanted) == 1
    assert not result.exists()
