"""Extras of glTF: what users keep with a thing, apart from what conversions note there.

Names of morph targets and everything under ``usdface`` are the conversion's own.
"""

import json
from typing import Any

from usdface.findings import Finding, finding
from usdface.scene import Extras

__all__ = ["kept_extras", "written_extras"]

_OURS = ("usdface", "targetNames")
_MOST_BYTES = 2**20  # of one thing, as JSON


def kept_extras(*given: Any, where: str) -> tuple[dict[str, Any], list[Finding]]:
    """Merge extras, the later over the earlier, without our own notes.

    What is larger than 1 MiB as JSON is left out (FEATURE_DROPPED).
    """
    merged: dict[str, Any] = {}
    for extras in given:
        merged |= extras if isinstance(extras, dict) else {}
    merged = {key: value for key, value in merged.items() if key not in _OURS}
    if merged and len(json.dumps(merged)) > _MOST_BYTES:
        message = f"extras larger than {_MOST_BYTES >> 20} MiB are left out"
        return {}, [finding("FEATURE_DROPPED", where, message)]
    return merged, []


def written_extras(extras: Extras, **ours: Any) -> dict[str, Any]:
    """Return a thing's extras together with notes of ours, where there are any."""
    return dict(extras) | {key: value for key, value in ours.items() if value}
