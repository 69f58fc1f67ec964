"""Whether the plug-in would load in this Python: for `usdface plugins`."""

import os
from importlib.util import find_spec
from pathlib import Path

__all__ = ["plugin_dir", "problems"]


def plugin_dir() -> Path:
    """Return the folder to put on PXR_PLUGINPATH_NAME."""
    return Path(__file__).parent


def problems() -> list[str]:
    """Return why usdview, run by this Python in this environment, would not load the plug-in."""
    found = []
    if find_spec("pxr") is None or find_spec("pxr.Usdviewq") is None:
        found.append("this Python has no usdview (pxr.Usdviewq); ask with the one that runs it")
    entries = os.environ.get("PXR_PLUGINPATH_NAME", "").split(os.pathsep)
    if plugin_dir() not in [Path(each) for each in entries if each]:
        found.append(f"{plugin_dir()} is not on PXR_PLUGINPATH_NAME")
    return found
