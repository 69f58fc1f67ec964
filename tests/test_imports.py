"""What a start of Python pays for: asked in processes of their own."""

import subprocess
import sys
from pathlib import Path

import pytest

FOREIGN = ("OpenImageIO", "ezc3d", "matplotlib", "pxr", "pygltflib", "scipy", "trimesh")


def loaded_by(code: str) -> set[str]:
    code += "\nimport sys\nprint('LOADED', *sys.modules)"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    last = result.stdout.splitlines()[-1].split()
    assert last[0] == "LOADED"
    return {*last[1:], *(module.partition(".")[0] for module in last[1:])}


def test_the_probe_sees_what_is_loaded() -> None:
    assert {"pxr", "numpy"} <= loaded_by("import pxr.Usd, numpy")


@pytest.mark.parametrize(
    "module",
    [
        "usdface",
        "usdface.cli",
        "usdface.errors",
        "usdface.findings",
        "usdface.formats",
        "usdface.io.export_targets",
        "usdface.io.rigs.formats",
        "usdface.io.takes.formats",
        "usdface.options",
        "usdface.pipeline",
        "usdface.schemas",
    ],
)
def test_light_modules_load_no_library(module: str) -> None:
    assert not {*FOREIGN, "numpy"} & loaded_by(f"import {module}")


@pytest.mark.parametrize("module", ["takes", "rigs", "setup.retarget_setup", "fuzzy", "retarget"])
def test_the_middle_loads_no_file_format(module: str) -> None:
    assert not (set(FOREIGN) - {"scipy"}) & loaded_by(f"import usdface.{module}")


@pytest.mark.parametrize(
    ("job", "others"),
    [
        ("checking", {"usdface.correction", "usdface.closure", "usdface.cleanup"}),
        ("processing", {"usdface.binding.resolve_binding", "scipy.interpolate"}),
    ],
)
def test_a_job_loads_no_modules_of_others(job: str, others: set[str]) -> None:
    assert not others & loaded_by(f"import usdface.pipeline.{job}")


def test_a_take_of_markers_loads_no_scipy(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("frame,a_x,a_y,a_z\n0,1,2,3\n1,1,2,4\n")
    words = ["take", str(tmp_path / "a.csv"), "--rate", "30", "-o", str(tmp_path / "a.usda")]
    assert "scipy" not in loaded_by(f"from usdface.cli import main; assert not main({words!r})")


def test_help_loads_no_library() -> None:
    code = """
import sys
from usdface.cli import main
sys.argv = ["usdface", "--help"]
try:
    main()
except SystemExit as end:
    assert not end.code
"""
    assert not {*FOREIGN, "numpy"} & loaded_by(code)
