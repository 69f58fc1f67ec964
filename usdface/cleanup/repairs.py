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
    """Return one finding for each marker and kind of repair."""
    groups: dict[tuple[Kind, str], list[Repair]] = defaultdict(list)
    for repair in repairs:
        groups[repair.kind, repair.marker].append(repair)
    findings = []
    for (kind, marker), group in groups.items():
        code, message = _CODES[kind]
        frames = sum(r.last - r.first + 1 for r in group)
        first = group[0]
        where = (
            f"frames {first.first} to {first.last}"
            if len(group) == 1
            else (f"{frames} frames in {len(group)} places, the first of them frame {first.first}")
        )
        findings.append(finding(code, marker, f"{message}: {where}"))
    return findings
