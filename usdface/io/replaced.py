"""Files that an output replaces: only what usdface wrote as the same kind of output.

What a person made or edited is kept unless told otherwise. A shot, the root layer of a result, a
deliverable and a binding have a fingerprint, so that an edit shows; the others are told by what
they are. Pictures, pages and text are not looked at.
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from usdface.errors import OutputError
from usdface.io.json_fingerprint import FINGERPRINT, is_unedited

__all__ = ["OutputKind", "check_replaced"]

OutputKind = Literal[
    "shot", "result", "deliverable", "take", "rig", "glTF", "binding", "calibration", "report"
]

_NAMES = {
    "shot": "a shot",
    "result": "a result of `process`",
    "deliverable": "a deliverable",
    "take": "a take",
    "rig": "a rig",
    "fuzzy system": "a fuzzy system",
    "glTF": "a glTF file",
    "binding": "a binding",
    "calibration": "a calibration",
    "report": "a report",
}
_LARGEST = 2**28  # bytes of JSON that is looked into
# Keys of each kind of report: of most commands; of `fuzzy explain` and `neutral`; of `bench`.
_REPORTS = (
    {"written", "findings", "summary", "seconds"},
    {"frame", "time_s", "emotions", "rules"},
    {"system", "neutral", "jitter_mean", "jitter_max"},
    {"title", "promise", "within", "computed"},
    {"test_frame", "radius_px", "ways"},
)
_CALIBRATED = {"gain", "deviation", "offset", "peak"}
_EDITED = "was edited since usdface wrote it"


def check_replaced(
    outputs: Iterable[tuple[Path | None, OutputKind]], overwrite: bool | None = False
) -> None:
    """Refuse to replace a file of another origin or kind, or that was edited, before any work.

    Parameters
    ----------
    outputs : iterable of (Path or None, OutputKind)
        None is no output. An empty file, which holds nothing, may be replaced.
    overwrite : bool or None
        Replace them all the same; None: the command has no option ``--overwrite``.

    Raises
    ------
    OutputError
    """
    if overwrite:
        return
    for place, kind in outputs:
        if place is None or not place.is_file() or not place.stat().st_size:
            continue
        if reason := _reason(place, kind):
            way = "choose another name"
            if overwrite is not None:
                way = "--overwrite replaces it, another name keeps it"
            raise OutputError(f"{place} {reason}; {way}")


def _reason(place: Path, kind: OutputKind) -> str:
    """Return why a file is not replaced by an output of a kind; "" if it may be."""
    if kind == "glTF":
        found, changed = _kind_of_gltf(place), ""
    elif kind in ("binding", "calibration", "report"):
        found, changed = _kind_of_json(place)
    else:
        from usdface.io.usd.own_layers import kind_of_usd  # loads USD only here

        found, edited = kind_of_usd(place)
        changed = _EDITED if edited else ""
    if not found:
        return f"is of another origin, not {_NAMES[kind]} that usdface wrote"
    return changed if found == kind else f"is {_NAMES[found]}, not {_NAMES[kind]}"


def _kind_of_gltf(path: Path) -> str:
    from usdface.io.gltf.files_beside import generator_of

    return "glTF" if generator_of(path).startswith("usdface") else ""


def _kind_of_json(path: Path) -> tuple[str, str]:
    """Return what a file is of the JSON that usdface writes, and how it was changed since."""
    try:
        if path.stat().st_size > _LARGEST:
            return "", ""
        document = json.loads(path.read_text(encoding="utf-8-sig"))
        if _is_binding(document):
            made = _EDITED if FINGERPRINT in document else "may hold places set by hand"
            return "binding", "" if is_unedited(document) else made
    except (OSError, ValueError, RecursionError):
        return "", ""
    if _is_report(document):
        return "report", ""
    return ("calibration", "") if _is_calibration(document) else ("", "")


def _is_binding(document: Any) -> bool:
    return isinstance(document, dict) and isinstance(document.get("markers"), dict)


def _is_report(document: Any) -> bool:
    first = document[0] if isinstance(document, list) and document else document
    return isinstance(first, dict) and any(keys <= first.keys() for keys in _REPORTS)


def _is_calibration(document: Any) -> bool:
    shapes = document.get("shapes") if isinstance(document, dict) else None
    return isinstance(shapes, dict) and all(
        isinstance(entry, dict) and entry.keys() >= _CALIBRATED for entry in shapes.values()
    )
