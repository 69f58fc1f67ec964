"""Whether the plug-in would load in this Python: for `usdface plugins`."""

from importlib.util import find_spec

__all__ = ["problems"]


def problems() -> list[str]:
    """Return why Maya, with this Python and environment, would not load the chaser."""
    names = ("maya", "mayaUsd", "pxr")
    missing = [name for name in names if find_spec(name) is None]
    if not missing:
        return []
    return [f"this Python has no {', '.join(missing)}; ask with mayapy and Maya's USD plug-in"]
