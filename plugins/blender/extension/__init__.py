"""usdface in Blender: a panel that retargets a take, and a USD hook for shots.

Nothing is solved here. The panel runs the `usdface` command in a process of its own and plays its
result; the hook authors the set-up of a shot on the stage that Blender exports.
"""

import atexit
import os
import sys

import bpy

OLDEST = (4, 5, 0)
_PLUGIN_PATH = "PXR_PLUGINPATH_NAME"
_modules = (
    "settings",
    "messages",
    "choose",
    "places",
    "process",
    "playback",
    "inspect_result",
    "export_gltf",
    "panel",
    "usd_hook",
)


def register() -> None:
    """Add the panel, its operators and the hook."""
    if bpy.app.version < OLDEST:
        wanted, found = (".".join(map(str, v[:2])) for v in (OLDEST, bpy.app.version))
        raise RuntimeError(f"usdface needs Blender {wanted} or later; this is {found}")
    # Blender's own USD, which a hook needs before an export calls it
    bpy.utils.expose_bundled_modules()
    _announce_schemas()
    for module in _loaded():
        module.register()
    # Blender 4.5 hangs at its end while a hook is registered
    atexit.register(unregister)


def unregister() -> None:
    """Remove all that `register` added."""
    atexit.unregister(unregister)
    for module in reversed(_loaded()):
        module.unregister()
    _withdraw_schemas()


def _loaded() -> list:
    from importlib import import_module

    return [import_module(f".{name}", __package__) for name in _modules]


def _schema_folder() -> str:
    from importlib.util import find_spec

    package = find_spec("usdface")
    return os.path.join(package.submodule_search_locations[0], "schemas") if package else ""


def _announce_schemas() -> None:
    """Put the schemas where USD looks for plug-ins, which it does once, at its first use."""
    folder = _schema_folder()
    places = [p for p in os.environ.get(_PLUGIN_PATH, "").split(os.pathsep) if p]
    if folder and folder not in places:
        os.environ[_PLUGIN_PATH] = os.pathsep.join([folder, *places])
    elif not folder:
        print("usdface: the package is not beside this Blender; install the extension's wheels")


def _withdraw_schemas() -> None:
    folder = _schema_folder()
    places = [p for p in os.environ.get(_PLUGIN_PATH, "").split(os.pathsep) if p and p != folder]
    if places:
        os.environ[_PLUGIN_PATH] = os.pathsep.join(places)
    else:
        os.environ.pop(_PLUGIN_PATH, None)


if __name__ == "__main__":
    sys.exit("install this folder as an extension: plugins/blender/build.py")
