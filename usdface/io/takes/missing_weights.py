"""Weights that a file lacks in some of its frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding

__all__ = ["WRITTEN", "bridge_weights"]

WRITTEN = 0.5  # of the frames, at least, have a weight of a curve that is read


def bridge_weights(
    path: Path,
    names: Sequence[str],
    times: FloatArray,
    weights: FloatArray,
    numbers: Sequence[int],
    message: str,
) -> list[Finding]:
    """Fill missing weights (F, S) in place: linear in time, held at the ends of a curve.

    `message` of the findings, WEIGHT_BRIDGED, has one value: the `numbers` (F,) of the frames.
    """
    findings = []
    missing = ~np.isfinite(weights)
    for shape in np.flatnonzero(missing.any(axis=0)).tolist():
        gaps, curve = missing[:, shape], weights[:, shape]
        curve[gaps] = np.interp(times[gaps], times[~gaps], curve[~gaps])
        lacking = [numbers[row] for row in np.flatnonzero(gaps).tolist()]
        findings.append(finding("WEIGHT_BRIDGED", f"{path}: {names[shape]}", message, lacking))
    return findings
