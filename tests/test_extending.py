"""A new take format from outside the package, as docs/extending.md shows it."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from checkout import run_usdface
from other_packages import Install, install
from pxr import Usd

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions
from usdface.pipeline import list_formats, make_take
from usdface.takes import MarkerTake

__all__ = ["install"]

PAGE = (Path(__file__).parents[1] / "docs" / "extending.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


@pytest.fixture
def package(install: Install) -> Path:
    project = tomllib.loads(block("toml"))["project"]
    assert project["name"] == "acme-xyz"
    return install("acme_xyz", block("python"), project["entry-points"])


@pytest.fixture
def recording(package: Path, tmp_path: Path) -> Path:
    path = tmp_path / "performance.xyz"
    path.write_text(block("text"), encoding="utf-8")
    return path


def test_the_recording_is_read_with_the_findings_of_any_other(recording: Path) -> None:
    take, findings = read_take(recording)
    assert isinstance(take, MarkerTake)
    assert take.names == ("chin", "nose")
    assert take.rate == 60 and take.source == "performance.xyz"
    np.testing.assert_allclose(take.positions[0], [[0, -0.012, 0.008], [0, 0.03, 0.095]])
    (occluded,) = findings
    assert (occluded.code, occluded.message) == ("MARKER_OCCLUDED", "occluded in 1 of 2 frames")


def test_options_hold_for_it(recording: Path) -> None:
    take, _ = read_take(recording, TakeOptions(units="cm", rate=30, up_axis="Z"))
    np.testing.assert_allclose(take.positions[0, 0], [0, 0.08, 0.12])
    assert take.times[1] == pytest.approx(1 / 30)


def test_an_unknown_unit_is_a_finding(recording: Path) -> None:
    recording.write_text(block("text").replace(" mm", " ft"), encoding="utf-8")
    _, findings = read_take(recording)
    assert "UNITS_ASSUMED" in {found.code for found in findings}


def test_a_damaged_file_is_one_line_that_names_the_reader(recording: Path) -> None:
    recording.write_text("ABC 60 mm\nchin\n0,0,0\n")
    with pytest.raises(InputError) as raised:
        read_take(recording)
    assert raised.value.code == "SCHEMA_BROKEN"
    assert "expected XYZ, rate, unit" in str(raised.value)
    assert "acme_xyz.read_xyz of acme_xyz 1.0 (acme_xyz:XYZ)" in str(raised.value)


def test_from_python(recording: Path, tmp_path: Path) -> None:
    result = make_take(recording, tmp_path / "take.usdc")
    assert result.summary["markers"] == 2
    assert Usd.Stage.Open(str(tmp_path / "take.usdc")).GetDefaultPrim()
    listed = list_formats().details["takes"][-1]
    assert listed == {
        "name": "XYZ",
        "suffixes": [".xyz"],
        "origin": "acme_xyz 1.0 (acme_xyz:XYZ)",
    }


@pytest.mark.slow
def test_from_the_command_line(recording: Path, package: Path, tmp_path: Path) -> None:
    """The documented command, in a process of its own."""
    (words,) = (line.split() for line in block("sh").splitlines())
    assert words[0] == "usdface"
    done = run_usdface(*words[1:], "--format", "json", folders=[package], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["summary"]["markers"] == 2
    assert (tmp_path / "take.usdc").is_file()
