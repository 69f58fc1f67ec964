"""Paths that USD cannot follow from one file to another.

Found with OpenUSD 26.11 by shots in folders, and of files, with such names. All other characters
work, `@`, `#`, `%`, brackets, quotes, blanks and any script among them.
"""

import re
from pathlib import Path

__all__ = ["unusable_part"]

_FAULTS = (
    # USD takes it for a slash where it joins the paths of two files.
    (re.compile(r"\\"), "a backslash"),
    # As `Sdf.AssetPath` refuses them.
    (re.compile(r"[\x00-\x1f\x7f-\x9f]"), "a control character"),
    # Arguments of the file format follow.
    (re.compile(r":SDF_FORMAT_ARGS:"), "':SDF_FORMAT_ARGS:'"),
)


def unusable_part(path: Path) -> str:
    """Return the reason why USD cannot open files by a path, as text; "" if it can.

    Of the whole path, as relative ones are joined to that of the file that has them.
    """
    parts = path.resolve().parts[1:]
    for fault, name in _FAULTS:
        for part in parts:
            if fault.search(part):
                return f"USD follows no path with {name}; rename {part!r}"
    return ""
