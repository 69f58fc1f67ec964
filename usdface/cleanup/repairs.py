"""Repairs of the clean-up, and their findings."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from usdface.findings import Finding, finding

__all__ = ["Kind", "Repair", "repair_findings"]

Kind = Literal["swap", "spike", "fill"]

_CODES: dict[Kind, tuple[str, str]] = {
    "swap": ("MARKER_SWAPPED", "had the label of another marker"),
    "spike": ("MARKER_SPIKE", "jumped away; taken as occluded"),
    "fill": ("MARKER_FILLED", "was occluded and is filled in"),
}


@dataclass(frozen=True, slots=True)
class Repair:
    """One repair: `marker` from frame index `first` to `last`, inclusive."""

    marker: str
    first: int
    last: int
    kind: Kind


def repair_findings(repairs: Sequence[Repair]) -> list[Finding]:
    """Return one finding for each marker and kind of repair, that of most frames first."""
    groups: dict[tuple[Kind, str], list[Repair]] = defaultdict(list)
    for repair in repairs:
        groups[repair.kind, repair.marker].append(repair)
    findings = []
    for (kind, marker), group in sorted(groups.items(), key=lambda each: -_frames(each[1])):
        code, message = _CODES[kind]
        frames, first = _frames(group), group[0]
        if len(group) == 1:
            message += ": frames {first_frame} to {last_frame}"
            findings.append(finding(code, marker, message, first.first, first.last))
        else:
            message += (
                ": {frame_count} frames in {place_count} places, the first of them frame "
                "{first_frame}"
            )
            findings.append(finding(code, marker, message, frames, len(group), first.first))
    return findings


def _frames(repairs: Sequence[Repair]) -> int:
    return sum(repair.last - repair.first + 1 for repair in repairs)
