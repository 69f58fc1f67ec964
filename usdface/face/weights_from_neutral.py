"""A take of weights, counted from its weights in the neutral frames."""

from dataclasses import replace

import numpy as np

from usdface.findings import Finding, finding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

__all__ = ["rest_kept", "resting_frames", "weights_from_neutral"]

# Length of the frames that are found [s]: a phone's tracking noise is a few hundredths of a weight.
_RESTING = 0.5
# A weight in the neutral frames from which on it is named. By hand: below it nobody sees it.
_NAMED = 0.03
# ... and from which on neutral frames are worth a word: lips that are 0.14 of a funnel are 1.5 to
# 2.1 mm apart on two faces.
_WORTH = 0.1
# Weights that are up in the neutral frames by more are no rest: they would be amplified too much.
_MOST = 0.5
_FEWEST = 60  # frames: a shorter take may rest nowhere
_ROUNDING = 1e-9  # of times [s]


def weights_from_neutral(
    take: WeightsTake, setup: RetargetSetup
) -> tuple[WeightsTake, list[Finding]]:
    """Return the take without its weights in the neutral frames, where the setup says so.

    A face tracker takes an open mouth or raised brows for a little of its shapes also where the
    face rests. A weight w becomes (w - r) / (1 - r), not below 0, with r its mean in the neutral
    frames: 0 there, and still 1 at 1.

    Returns
    -------
    WeightsTake
    list of Finding
        NEUTRAL_REMOVED, if a weight is up in the neutral frames.
    """
    if not setup.neutral_removed or setup.neutral is None:
        return take, []
    first, last = setup.neutral
    rest = take.weights[first : last + 1].mean(axis=0).clip(0.0, _MOST)
    weights = ((take.weights - rest) / (1.0 - rest)).clip(min=np.minimum(take.weights, 0.0))
    names = [take.names[i] for i in np.argsort(-rest, kind="stable") if rest[i] > _NAMED]
    findings = []
    if names:
        message = (
            "the neutral frames show {curves}, up to {weight:.2f}; subtracted from the whole take"
        )
        findings = [finding("NEUTRAL_REMOVED", take.source, message, names, float(rest.max()))]
    return replace(take, weights=weights), findings


def rest_kept(take: WeightsTake, setup: RetargetSetup) -> list[Finding]:
    """Return NEUTRAL_KEPT if no neutral is subtracted and the take does not rest in any frames."""
    if setup.neutral_removed or len(take.times) < _FEWEST:
        return []
    first, last = resting_frames(take)
    rest = take.weights[first : last + 1].mean(axis=0)
    names = [take.names[i] for i in np.argsort(-rest, kind="stable") if rest[i] > _WORTH]
    if not names:
        return []
    message = (
        "in the least expressive frames, {first_frame} to {last_frame}, {curves} are up to "
        "{weight:.2f}; if the face rests there, `usdface shot --neutral auto` subtracts that"
    )
    found = finding("NEUTRAL_KEPT", take.source, message, first, last, names, float(rest.max()))
    return [found]


def resting_frames(take: WeightsTake) -> tuple[int, int]:
    """Return the first and the last frame of the half second in which the weights are least."""
    sums = np.abs(take.weights).sum(axis=1)
    last = np.searchsorted(take.times, take.times + _RESTING + _ROUNDING, side="right") - 1
    whole = np.flatnonzero(take.times + _RESTING <= take.times[-1] + _ROUNDING)
    if not len(whole):
        return 0, len(sums) - 1
    counted = np.concatenate([[0.0], np.cumsum(sums)])
    means = (counted[last[whole] + 1] - counted[whole]) / (last[whole] + 1 - whole)
    begin = int(whole[means.argmin()])
    return begin, int(last[begin])
