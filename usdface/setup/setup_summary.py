"""Figures of a retarget setup for the summaries of results."""

from typing import Any

import numpy as np

from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["bound_count", "neutral_summary", "proposal_summary"]


def bound_count(setup: RetargetSetup, take: MarkerTake | WeightsTake) -> int:
    """Return how many bound markers there are in a take; in one of weights, how many are bound."""
    bound = setup.binding.markers
    return len(set(bound) & set(take.names)) if isinstance(take, MarkerTake) else len(bound)


def neutral_summary(setup: RetargetSetup) -> list[int] | str:
    """Return the first and the last neutral frame, or "rig", for a report."""
    return "rig" if setup.neutral is None else list(setup.neutral)


def proposal_summary(setup: RetargetSetup) -> dict[str, Any]:
    """Return neutral and peak frames, and the confidence of proposed vertices, for a report."""
    summary: dict[str, Any] = {}
    confidence = setup.binding.confidence
    if setup.peaks:
        summary["neutral_frames"] = neutral_summary(setup)
        summary["peak_frames"] = list(setup.peaks)
    if confidence is not None and not np.isnan(confidence).all():
        summary["confidence_mean"] = round(float(np.nanmean(confidence)), 3)
        summary["confidence_min"] = round(float(np.nanmin(confidence)), 3)
    return summary
