"""usdface in Blender: a panel that retargets a take, and a USD hook for shots.

Nothing is solved here. The panel runs the `usdface` command in a process of its own and plays its
result; the hook authors the setup of a shot on the stage that Blender exports.
"""

import atexit
import sys
from importlib import import_module

import bpy

OLDEST = (4, 5, 0)
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
    for module in _loaded():
        module.register()
    atexit.register(_at_the_end)


def unregister() -> None:
    """Remove all that `register` added."""
    atexit.unregister(_at_the_end)
    for module in reversed(_loaded()):
        module.unregister()


def _at_the_end() -> None:
    """Remove the hook: Blender 4.5 hangs at its end while one is registered."""
    import_module(".usd_hook", __package__).unregister()


def _loaded() -> list:
    return [import_module(f".{name}", __package__) for name in _modules]


if __name__ == "__main__":
    sys.exit("install this folder as an extension: plugins/blender/build.py")
