"""The usdview plug-in is found and loaded by USD's own Plug, and calls what usdview has."""

import ast
import importlib.util
import json
import subprocess
import sys

import pytest
from checkout import CHECKOUT, environment
from usdview_stand_in import USED

PLUGIN = CHECKOUT / "plugins" / "usdview" / "usdface_usdview"
FOLDERS = (PLUGIN.parent, CHECKOUT / "tests")
# Names of usdview's objects in the plug-in
_OWNERS = (
    "usdview",
    "_usdview",
    "usdview.dataModel",
    "_usdview.dataModel",
    "plugRegistry",
    "plugUIBuilder",
    "menu",
)
LOAD = """
import json, sys
from usdview_stand_in import install_stand_in, load_containers
install_stand_in(qt=False)
registry, builder = load_containers(None)
print(json.dumps({
    "commands": list(registry.commands),
    "menus": {name: menu.items for name, menu in builder.menus.items()},
    "loaded": [name for name in sys.modules if name.startswith(("usdface", "numpy", "PySide"))],
}))
"""


def test_plug_finds_the_container_and_its_menu() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOAD],
        env=environment(*FOLDERS, PXR_PLUGINPATH_NAME=str(PLUGIN)),
        capture_output=True,
        text=True,
        check=True,
    )
    report = json.loads(done.stdout)
    names = ("show_panel", "process", "toggle_expressions", "save")
    assert report["commands"] == [f"UsdfaceContainer.{name}" for name in names]
    assert len(report["menus"]["usdface"]) == 4
    # usdview starts as fast as without it
    assert report["loaded"] == ["usdface_usdview", "usdface_usdview.container"]


def test_the_plug_in_says_what_it_lacks() -> None:
    script = (
        "from usdface_usdview.check import problems; import json; print(json.dumps(problems()))"
    )
    for path, count in (("", 2), (str(PLUGIN), 1)):
        done = subprocess.run(
            [sys.executable, "-c", script],
            env=environment(*FOLDERS, PXR_PLUGINPATH_NAME=path),
            capture_output=True,
            text=True,
            check=True,
        )
        report = json.loads(done.stdout)
        if importlib.util.find_spec("pxr.Usdviewq") is None:
            assert "no usdview" in report[0]
            assert len(report) == count


def used_names() -> set[str]:
    """Every name that the plug-in's sources take from usdview's objects."""
    found = set()
    for path in PLUGIN.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Attribute):
                continue
            owner = ast.unparse(node.value).removeprefix("self.")
            if owner in _OWNERS or (owner == "self" and node.attr == "deferredImport"):
                found.add(node.attr)
    return found


def test_each_name_it_calls_is_one_that_usdview_has() -> None:
    known = {name for classes in USED.values() for names in classes.values() for name in names}
    assert used_names() <= known
    assert {"registerCommandPlugin", "UpdateViewport", "signalStageReplaced"} <= used_names()


def test_imports_from_usdview_are_those_it_has() -> None:
    for path in PLUGIN.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("pxr.Usdviewq"):
                module = f"{str(node.module).rpartition('.')[2]}.py"
                for alias in node.names:
                    assert alias.name in {*USED[module], *USED[module].get("", ())}


@pytest.mark.skipif(
    importlib.util.find_spec("pxr.Usdviewq") is None,
    reason="no package registry carries pxr.Usdviewq; this runs where usdview is built",
)
def test_the_real_usdview_has_them() -> None:
    from pxr.Usdviewq import plugin, rootDataModel, usdviewApi  # type: ignore[import-not-found]

    modules = {
        "plugin.py": plugin,
        "usdviewApi.py": usdviewApi,
        "rootDataModel.py": rootDataModel,
    }
    for file, module in modules.items():
        for owner, names in USED[file].items():
            assert [name for name in names if not hasattr(getattr(module, owner), name)] == []
