"""One certificate for all clips of a character."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from usdface.certificate.certificate import Certificate
from usdface.certificate.compare import certify

__all__ = ["merge_certificates"]


def merge_certificates(clips: Mapping[str, Certificate], missing: Sequence[str]) -> Certificate:
    """Return one certificate for all clips of a character; `missing` are those of one side."""
    parts = list(clips.values())
    if not parts:
        return replace(certify([], [], np.zeros(0, np.int64)), missing=tuple(missing))
    worst = max(parts, key=lambda part: part.vertex_largest)
    turned = [p for p in parts if p.normal_largest is not None]
    weights: dict[str, float] = {}
    for part in parts:
        for channel, off in part.weights.items():
            weights[channel] = max(weights.get(channel, 0.0), off)
    lacking = dict.fromkeys([*missing, *(name for part in parts for name in part.missing)])
    return Certificate(
        frames=sum(p.frames for p in parts),
        of_frames=sum(p.of_frames for p in parts),
        diagonal=max(p.diagonal for p in parts),
        vertex_largest=worst.vertex_largest,
        vertex_mean=_mean(parts, [p.vertex_mean for p in parts]),
        vertex_worst=worst.vertex_worst,
        normal_largest=max((p.normal_largest or 0.0 for p in turned), default=None),
        normal_mean=_mean(turned, [p.normal_mean or 0.0 for p in turned]) if turned else None,
        weights=weights,
        weight_excess=max(p.weight_excess for p in parts),
        vertex_excess=max(p.vertex_excess for p in parts),
        normal_excess=max(p.normal_excess for p in parts),
        vertex_rounding=max(p.vertex_rounding for p in parts),
        normal_rounding=max(p.normal_rounding for p in parts),
        time_drift=max(p.time_drift for p in parts),
        duration=max(p.duration for p in parts),
        names={name: now for part in parts for name, now in part.names.items()},
        missing=tuple(lacking),
        clips=clips if len(clips) > 1 else {},
    )


def _mean(parts: Sequence[Certificate], values: Sequence[float]) -> float:
    frames = [max(part.frames, 1) for part in parts]
    return float(np.average(values, weights=frames))
