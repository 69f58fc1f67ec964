"""The fingerprint of a JSON file that usdface wrote: whether it was edited since.

It is a digest of all else in the file, whatever its layout and the order of its keys.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

__all__ = ["FINGERPRINT", "is_unedited", "sign"]

FINGERPRINT = "fingerprint"


def sign(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document that is about to be written, with its fingerprint."""
    return {**document, FINGERPRINT: _digest(document)}


def is_unedited(document: Mapping[str, Any]) -> bool:
    """Return whether a document that was read has a fingerprint, and that of its content."""
    return document.get(FINGERPRINT) == _digest(document)


def _digest(document: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in document.items() if key != FINGERPRINT}
    # As it will be read: without tuples, and with text for keys.
    text = json.dumps(json.loads(json.dumps(rest)), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
