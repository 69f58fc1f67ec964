"""A sequence through the command: what fails fails alone, and the table says which and why."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from worlds import make_world

from usdface.cli import main
from usdface.cli.sequence import _print_table
from usdface.show.table import Row

SHOW = """
folder = "shots"
files = ["old/*.usda"]
[characters.mia]
rig = "rig.usda"
bind = "bind.json"
layer = "sets/mia.usda"
[performers.anna]
[[shots]]
name = "good"
take = "take.usda"
character = "mia"
performer = "anna"
process = {page = true}
[[shots]]
name = "no_take"
take = "none.usda"
character = "mia"
[[shots]]
name = "no_calibration"
take = "take.usda"
character = "mia"
calibration = "none.json"
[[shots]]
name = "twice"
file = "same.usda"
take = "take.usda"
character = "mia"
[[shots]]
name = "again"
file = "same.usda"
take = "take.usda"
character = "mia"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("show"))
    (folder / "show.toml").write_text(SHOW)
    (folder / "old").mkdir()
    (folder / "old/damaged.usda").write_text("#usda 1.0\ndef Scope (")
    return folder


def sequence(folder: Path, *options: str) -> tuple[int, dict[str, dict[str, object]]]:
    report = folder / "report.json"
    status = main(["sequence", str(folder / "show.toml"), "--report", str(report), *options])
    rows = json.loads(report.read_text())["shots"]
    return status, {row["name"]: row for row in rows}


@pytest.mark.slow
def test_the_sequence_goes_on_and_the_table_says_why(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    status, rows = sequence(folder, "--table", str(folder / "show.html"), "--workers", "1")
    assert status == 1
    assert list(rows)[-1] == "good" and rows["good"]["verdict"] == "good"
    assert rows["good"]["findings"]["PERFORMER_UNCALIBRATED"] == 1
    codes = {name: row["code"] for name, row in rows.items() if row["state"] == "failed"}
    assert codes == {
        "no_take": "FILE_UNREADABLE",
        "no_calibration": "FILE_UNREADABLE",
        "damaged": "FILE_UNREADABLE",
        "twice": "OUTPUT_UNWRITABLE",
        "again": "OUTPUT_UNWRITABLE",
    }
    assert "written by again" in str(rows["twice"]["error"])
    assert not (folder / "same.usda").exists()
    # Also the shot that was made, on which its result lies, and the layers that it shares.
    written = {Path(name).name for name in rows["good"]["written"]}
    assert {"good.usda", "mia.usda", "good.usdface.usda"} <= written
    assert "../sets/mia.usda" in (folder / "shots/good.usda").read_text()
    page = (folder / "show.html").read_text()
    assert 'href="shots/good.usdface.html"' in page
    assert (folder / "shots/good.usdface.html").is_file()
    printed = capfd.readouterr()
    assert "error SHOT_FAILED" in printed.out and "good.usdface.usda" in printed.out


def test_stages_are_of_the_run_that_the_table_is_of(capsys: pytest.CaptureFixture[str]) -> None:
    made = Row(name="a", stages={"clean": "cached", "solve": "computed"})
    _print_table([made, replace(made, name="b", state="kept")])
    first, other = (line.split() for line in capsys.readouterr().out.splitlines()[1:])
    assert first == ["a", "processed,", "clean", "cached"] and other == ["b", "kept"]


@pytest.mark.slow
def test_a_shot_that_takes_too_long_fails_and_one_that_is_kept_does_not(folder: Path) -> None:
    status, rows = sequence(folder, "--time-limit", "0.01", "--index", "1-2")
    assert status == 1 and rows["good"]["state"] == "kept"
    assert rows["no_take"]["code"] == "WORKER_HUNG"
    assert sequence(folder, "--index", "1")[0] == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--workers", "0"], "--workers"),
        (["--time-limit", "-1"], "--time-limit"),
        (["--time-limit", "nan"], "--time-limit"),
        (["--table", "show.txt"], "a page is HTML"),
        (["--openjd", "job", "--index", "0", "--cache", "c"], "takes no --cache, --index"),
        (["--gather", "--watch"], "--gather takes no --watch"),
        (["--gather", "--overwrite"], "--gather takes no --overwrite"),
        (["--openjd", "job", "--overwrite"], "--openjd takes no --overwrite"),
        (["--chunk", "2"], "--openjd DIR"),
        (["--skip-hook", "acme"], "--skip-hook acme: there is no such hook"),
    ],
)
def test_wrong_settings_are_refused(
    folder: Path, options: list[str], words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["sequence", str(folder / "show.toml"), *options]) == 1
    assert words in capfd.readouterr().err
