"""Plug-ins call the public API and stay small; usdface knows no host."""

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import usdface

ROOT = Path(__file__).parents[2]
PLUGINS = sorted((ROOT / "plugins").rglob("*.py"))
HOSTS = ("bpy", "hou", "maya", "mayaUsd", "pxr.Usdviewq")
# Public beside the names of `usdface`: docs/usd.md, docs/api.md
MODULES = ("usdface", "usdface.schemas")


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """Yield each module that a file imports, and the name it takes from it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from ((node.module, alias.name) for alias in node.names)


@pytest.mark.parametrize("path", PLUGINS, ids=lambda path: str(path.relative_to(ROOT)))
def test_it_calls_the_public_api_alone(path: Path) -> None:
    for module, name in imports(path):
        if module.partition(".")[0] == "usdface":
            assert module in MODULES
            assert module != "usdface" or name in ("", *usdface.__all__)
    tree = ast.parse(path.read_text(encoding="utf-8"))
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "usdface"
    }
    assert used <= {*usdface.__all__, "__version__", "schemas"}


@pytest.mark.parametrize("path", PLUGINS, ids=lambda path: str(path.relative_to(ROOT)))
def test_it_stays_small(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 300


def test_the_extension_installs_in_the_blenders_that_its_wheels_are_for() -> None:
    folder = ROOT / "plugins" / "blender"
    (host,) = tomllib.loads((folder / "host.toml").read_text(encoding="utf-8"))["blender"]
    manifest = tomllib.loads(
        (folder / "extension" / "blender_manifest.toml").read_text(encoding="utf-8")
    )
    first, last = (tuple(map(int, host["versions"][i].split("."))) for i in (0, -1))
    assert manifest["blender_version_min"] == f"{first[0]}.{first[1]}.0"
    assert manifest["blender_version_max"] == f"{last[0]}.{last[1] + 1}.0"


def test_a_python_without_pip_builds_no_extension_and_is_named(tmp_path: Path) -> None:
    build = ROOT / "plugins" / "blender" / "build.py"
    without_packages = [sys.executable, "-I", "-S", build, "-o", tmp_path / "usdface.zip"]
    ended = subprocess.run(without_packages, capture_output=True, text=True)
    assert ended.returncode == 2
    assert f"{sys.executable} has no pip" in ended.stderr and "Traceback" not in ended.stderr


@pytest.mark.slow
def test_usdface_imports_no_host() -> None:
    for path in (ROOT / "usdface").rglob("*.py"):
        for module, _ in imports(path):
            assert not module.startswith(HOSTS), path
