"""Extras of glTF: those of users, apart from the metadata of conversions.

Names of morph targets and everything under ``usdface`` are the conversion's own.
"""

import json
from typing import Any

from usdface.findings import Finding, finding
from usdface.scene import Extras

__all__ = ["RESERVED", "extras_with_metadata", "read_extras"]

RESERVED = ("usdface", "targetNames")
_MOST_BYTES = 2**20  # of one thing, as JSON


def read_extras(*given: Any, where: str) -> tuple[dict[str, Any], list[Finding]]:
    """Merge extras, the later over the earlier, without metadata of conversions.

    Extras larger than 1 MiB as JSON are left out, and values that later ones replace
    (FEATURE_DROPPED).
    """
    merged: dict[str, Any] = {}
    found: list[Finding] = []
    for extras in given:
        own = dict(extras) if isinstance(extras, dict) else {}
        own = {key: value for key, value in own.items() if key not in RESERVED}
        replaced = [key for key, value in own.items() if merged.get(key, value) != value]
        if replaced:
            message = "extras of its content are left out, as its node has others: {names}"
            found.append(finding("FEATURE_DROPPED", where, message, replaced, feature="extras"))
        merged |= own
    if merged and len(json.dumps(merged)) > _MOST_BYTES:
        message = "extras larger than {limit_mib} MiB are left out"
        return {}, [finding("FEATURE_DROPPED", where, message, _MOST_BYTES >> 20, feature="extras")]
    return merged, found


def extras_with_metadata(extras: Extras, **ours: Any) -> dict[str, Any]:
    """Return extras together with metadata of the conversion, where there is any."""
    return dict(extras) | {key: value for key, value in ours.items() if value}
