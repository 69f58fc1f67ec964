"""`usdface process --pieces`: estimates, pieces as tasks, and the joined result."""

import json
import resource
from dataclasses import replace
from pathlib import Path

import pytest
from worlds import make_world

from usdface.cli import main
from usdface.hooks import Hook
from usdface.io.usd.take_write import write_take
from usdface.pipeline import long_take
from usdface.shot import piece_cuts


@pytest.fixture
def shot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, value in (
        ("BLOCK", 10),
        ("BLOCKS", 2),
        ("MARGIN", 0),
        ("STRETCH", 8),
        ("STRETCHES", 3),
    ):
        monkeypatch.setattr(piece_cuts, f"_{name}", value)
    make_world().write(tmp_path)
    files = ["--rig", "rig.usda", "--take", "take.usda", "--bind", "bind.json"]
    files = [str(tmp_path / word) if "." in word else word for word in files]
    assert main(["shot", *files, "-o", str(tmp_path / "shot.usda")]) == 0
    return tmp_path / "shot.usda"


def run(shot: Path, *options: str) -> dict[str, object]:
    report = shot.parent / "report.json"
    words = ["process", str(shot), "--pieces", str(shot.parent / "pieces"), "--workers", "1"]
    assert main([*words, "--report", str(report), *options]) == 0
    return json.loads(report.read_text())["summary"]


@pytest.mark.slow
def test_tasks_in_any_order_give_the_bytes_of_one_run(shot: Path) -> None:
    run(shot)
    results = sorted((shot.parent / "shot.usdface").glob("*.usdc"))
    once = [file.read_bytes() for file in results]
    for file in (*results, *(shot.parent / "pieces").iterdir()):
        file.unlink()
    assert run(shot, "--piece", "estimates")["computed"] == 1
    assert run(shot, "--piece", "1")["computed"] == 1
    summary = run(shot, "--piece", "0-1")
    assert (summary["computed"], summary["cached"], summary["pieces"]) == (1, 2, 2)
    assert not results[0].exists()
    assert run(shot)["stages"] == {"solve": "joined", "express": "computed"}
    assert [file.read_bytes() for file in results] == once


def test_a_folder_that_cannot_keep_pieces_is_refused(
    shot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["process", str(shot), "--pieces", str(shot), "--piece", "estimates"]
    assert main(words) == 1
    assert "shot.usda is no folder" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("piece", ["estimates", "0"])
def test_what_cannot_be_kept_fails_a_piece(
    shot: Path, capsys: pytest.CaptureFixture[str], piece: str
) -> None:
    if piece == "0":
        run(shot, "--piece", "estimates")
    capsys.readouterr()
    words = ["process", str(shot), "--pieces", str(shot.parent / "pieces"), "--piece", piece]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))  # as a disk that is full
    try:
        status = main([*words, "--workers", "1"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert status == 1
    assert "cannot write" in (printed := capsys.readouterr().err) and "File too large" in printed
    assert run(shot, "--piece", piece)["computed"] == 1


def test_workers_without_pieces_are_refused(shot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["process", str(shot), "--workers", "2"]) == 1
    assert "--pieces DIR" in capsys.readouterr().err


@pytest.mark.slow
def test_a_changed_take_is_solved_anew(shot: Path) -> None:
    run(shot, "--piece", "0-1")
    take = make_world().take
    positions = take.positions.copy()
    positions[30, 0, 0] += 1e-4
    write_take(replace(take, positions=positions), shot.parent / "take.usda")
    # The estimates come from other frames: they are found again, and are the same.
    summary = run(shot, "--piece", "0-1")
    assert (summary["computed"], summary["cached"]) == (2, 1)
    assert run(shot, "--piece", "0-1", "--solve", "frame")["computed"] == 3


@pytest.mark.parametrize("options", [["--piece", "2"], ["--piece", "x"], ["--workers", "0"]])
def test_wrong_settings_are_refused(shot: Path, options: list[str]) -> None:
    pieces = ["--pieces", str(shot.parent / "pieces")]
    assert main(["process", str(shot), *pieces, *options]) == 1
    assert main(["process", str(shot), "--piece", "0"]) == 1


def test_hooks_see_whole_takes(
    shot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    hook = Hook("take_read", "acme:hook", lambda take, shot: None)
    monkeypatch.setattr(long_take, "installed_hooks", lambda skip: ((hook,), []))
    assert main(["process", str(shot), "--pieces", str(shot.parent / "pieces")]) == 1
    assert "--skip-hook" in capsys.readouterr().err
