"""Tests that start a process of their own test this checkout."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import CHECKOUT, environment, run_usdface


def test_a_process_from_any_folder_imports_this_checkout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "elsewhere"))
    (tmp_path / "first.py").write_text("")
    code = "import first, json, sys, usdface; print(json.dumps([usdface.__file__, sys.path]))"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(tmp_path), cwd=tmp_path, capture_output=True
    )
    file, path = json.loads(done.stdout)
    assert Path(file).parents[1] == CHECKOUT
    places = [path.index(str(each)) for each in (tmp_path, CHECKOUT, tmp_path / "elsewhere")]
    assert places == sorted(places)


def test_the_command_line_gives_bytes_and_its_status() -> None:
    done = run_usdface("--no-such-option")
    assert done.returncode == 2 and done.stderr.startswith(b"usage: usdface")
