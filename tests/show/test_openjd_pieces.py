"""The bundle of a very long take: valid, and run for real it gives the bytes of one command."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from openjd_program import openjd
from worlds import make_world

from usdface.cli import main
from usdface.shot import piece_cuts


def make_shot(folder: Path) -> Path:
    make_world().write(folder)
    files = ["--rig", "rig.usda", "--take", "take.usda", "--bind", "bind.json"]
    files = [str(folder / word) if "." in word else word for word in files]
    assert main(["shot", *files, "-o", str(folder / "shot.usda")]) == 0
    return folder / "shot.usda"


def test_estimates_then_pieces_then_the_join(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("BLOCK", 10), ("BLOCKS", 2)):
        monkeypatch.setattr(piece_cuts, f"_{name}", value)
    shot = make_shot(tmp_path / "show")
    pieces, job = tmp_path / "pieces", tmp_path / "job"
    words = ["--pieces", str(pieces), "--openjd", str(job), "--chunk", "2"]
    more = ["--gains", "joy=0.5", "--no-head", "--gltf", "face.glb"]
    more += ["--deliver", "face.usdc", "--start", "-3", "--end", "0"]
    assert main(["process", str(shot), *words, *more]) == 0
    assert not pieces.exists()
    bundle = {path.stem: json.loads(path.read_text()) for path in job.iterdir()}
    values = {v["name"]: v["value"] for v in bundle["parameter_values"]["parameterValues"]}
    assert values == {"Shot": str(shot), "Pieces": str(pieces), "Chunk": 2, "Indices": "0-1"}
    steps = bundle["template"]["steps"]
    assert [step["name"] for step in steps] == ["Estimates", "Pieces", "Join"]
    assert [step.get("dependencies") for step in steps] == [
        None,
        [{"dependsOn": "Estimates"}],
        [{"dependsOn": "Pieces"}],
    ]
    arguments = [step["script"]["actions"]["onRun"]["args"] for step in steps]
    for each in arguments:
        assert {"--gains=joy=0.5", "--no-head"} <= set(each)
    assert ["--gltf=face.glb" in each for each in arguments] == [False, False, True]
    assert {"--start=-3", "--end=0"} <= set(arguments[2]) and "--piece" not in arguments[2]
    names = {
        Path(n).name for n in bundle["asset_references"]["assetReferences"]["inputs"]["filenames"]
    }
    assert names == {"shot.usda", "rig.usda", "take.usda"}


@pytest.mark.parametrize(
    "words", [["--openjd", "job"], ["--pieces", "p", "--openjd", "job", "--chunk", "0"]]
)
def test_wrong_settings_are_refused(tmp_path: Path, words: list[str]) -> None:
    shot = make_shot(tmp_path)
    words = [str(tmp_path / word) if word in ("job", "p") else word for word in words]
    assert main(["process", str(shot), *words]) == 1
    assert not (tmp_path / "job").exists()


def test_a_chunk_without_a_job_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shot = make_shot(tmp_path)
    assert main(["process", str(shot), "--chunk", "4"]) == 1
    assert "--openjd DIR" in capsys.readouterr().err
    assert not shot.with_name("shot.usdface.usda").exists()


@pytest.mark.slow
def test_a_run_of_the_bundle_gives_the_same_bytes(tmp_path: Path) -> None:
    """Two pieces, as the sizes are: 20,000 frames of a small world."""
    shot = make_long_shot(tmp_path / "show", 20_000)
    common = ["process", str(shot), "--pieces"]
    job = tmp_path / "job"
    assert main([*common, str(tmp_path / "farm"), "--openjd", str(job), "--no-closure"]) == 0
    template = job / "template.json"
    assert "passes validation checks" in openjd("check", template)
    program = Path(sys.executable).with_name("usdface")
    values = json.loads((job / "parameter_values.json").read_text())["parameterValues"]
    given = [f"{value['name']}={value['value']}" for value in values]
    given = [word for value in (*given, f"Usdface={program}") for word in ("-p", value)]
    result = openjd("run", template, *given, "--step", "Join", "--run-dependencies")
    assert "Piece(CHUNK[INT]) = 0" in result and "Piece(CHUNK[INT]) = 1" in result
    results = sorted((shot.parent / "shot.usdface").glob("*.usdc"))
    farmed = {file.name: file.read_bytes() for file in results}
    for file in results:
        file.unlink()
    assert main([*common, str(tmp_path / "pieces"), "--workers", "2", "--no-closure"]) == 0
    assert {file.name: file.read_bytes() for file in results} == farmed
    assert len(results) == 2


def make_long_shot(folder: Path, frames: int) -> Path:
    from dataclasses import replace

    from usdface.io.usd.take_write import write_take

    shot = make_shot(folder)
    take = make_world().take
    count = len(take.times)
    order = np.concatenate([np.arange(count), np.arange(count)[::-1]])
    order = np.resize(order, frames)
    noise = 1e-4 * np.random.default_rng(0).standard_normal((frames, *take.positions.shape[1:]))
    times = np.arange(frames) / take.rate
    write_take(
        replace(take, times=times, positions=take.positions[order] + noise), folder / "take.usda"
    )
    return shot
