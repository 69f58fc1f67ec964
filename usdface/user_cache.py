"""The folder in which usdface keeps things for this user between runs."""

import os
from pathlib import Path

__all__ = ["user_cache_folder"]


def user_cache_folder(name: str) -> Path | None:
    """Return the folder of that name in the user's cache, which need not exist yet.

    It lies in ``$XDG_CACHE_HOME``, or else ``~/.cache`` (XDG Base Directory Specification 0.8).
    None for a user who has no home.
    """
    try:
        named = Path(os.environ.get("XDG_CACHE_HOME", ""))
        home = named if named.is_absolute() else Path.home() / ".cache"
    except RuntimeError:
        return None
    return home / "usdface" / name
