"""Findings on neutral frames that were looked for."""

from usdface.face.bound_face import BoundFace
from usdface.finding_values import Prose
from usdface.findings import Finding, finding
from usdface.retarget.neutral_weights import weights_at_limit
from usdface.retarget_setup import RetargetSetup

__all__ = ["neutral_findings"]

# Blend shapes that a message names.
_NAMED = 3


def neutral_findings(setup: RetargetSetup, face: BoundFace, source: str) -> list[Finding]:
    """Report the neutral frames of a take that were found, and an expression that they show."""
    first, last = setup.neutral or (0, 0)
    message = "the face rests in frames {first_frame} to {last_frame}: taken as neutral"
    shown = sorted(setup.neutral_weights.items(), key=lambda item: -item[1])
    if not shown:
        return [finding("NEUTRAL_FOUND", source, message, first, last)]
    message += ", less the {shape_count} blend shapes that show there (most: {most})"
    most = Prose(", ".join(f"{name} {weight:.2f}" for name, weight in shown[:_NAMED]))
    names = [name for name, _ in shown]
    found = finding("NEUTRAL_FOUND", source, message, first, last, len(shown), most, shapes=names)
    # The estimate ends there: how much more of these shapes shows is not known.
    cut = weights_at_limit(dict(shown), face)
    if not cut:
        return [found]
    message = (
        "frames {first_frame} to {last_frame}, taken as neutral, show an expression ({shapes}): "
        "more than is taken off; name frames in which the face rests"
    )
    return [found, finding("NEUTRAL_AT_LIMIT", source, message, first, last, [*cut[:_NAMED]])]
