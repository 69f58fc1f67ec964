"""Parts crossing lids of both eyes: pins stay, and the lower lid gives way in good time."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.ndimage import grey_closing, grey_opening

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.blink_motion import LONGEST_BLINK
from usdface.closure.even_times import EvenTimes, even_times
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.closure.lid_contact import (
    crossing,
    looks_open,
    lower_until_parted,
    lowering,
    part_crossed_lids,
)
from usdface.findings import Finding, finding
from usdface.numerics.frame_ranges import frame_ranges

__all__ = ["one_shape_for_both", "part_eyes"]

_Part = Callable[[FloatArray, LidApertures, BoolArray], FloatArray]
# The lower lid gives way, and comes back, in as long as the slowest blink opens [s] (`blinks`).
_GIVES_WAY = 0.3
# Eyes whose weights differ by less are shut alike. By hand: those of closed eyes on a phone differ
# by up to 0.02, of winks by 0.5 and more.
_UNLIKE = 0.1
# Least crossing that is reported [m].
_REPORTED = 1e-4
# [m]: the rest of a bisection. Least fall of a weight that is reported, of those that raise the
# lower lid.
_EXACT = 1e-6
_FALLEN = 0.1


def part_eyes(
    weights: FloatArray,
    by_eye: Mapping[Eye, LidApertures],
    near_pins: FloatArray,
    times: FloatArray,
) -> tuple[FloatArray, list[Finding]]:
    """Part lids that cross.

    Parameters
    ----------
    weights : (F, T) float64
    by_eye : mapping of "left", "right" to LidApertures
    near_pins : (F, T) float64
        `usdface.retarget.pins.pin_nearness`; pinned weights stay.
    times : (F,) float64 [s]

    Returns
    -------
    weights : (F, T) float64
    findings : list of Finding
    """
    parted = _both_parted(weights, by_eye, near_pins, even_times(times))
    findings: list[Finding] = []
    for eye, apertures in by_eye.items():
        # What lowers a shape that closes both eyes may be the other one.
        causes = [*by_eye.values()] if one_shape_for_both(by_eye) else [apertures]
        findings += _crossing(eye, apertures, parted) + _opened(
            eye, apertures, causes, weights, parted
        )
    return parted, findings


def one_shape_for_both(by_eye: Mapping[Eye, LidApertures]) -> bool:
    """Return whether the two eyes close by the same blend shape."""
    return len(by_eye) == 2 and by_eye["left"].closer == by_eye["right"].closer


def _both_parted(
    weights: FloatArray,
    by_eye: Mapping[Eye, LidApertures],
    near_pins: FloatArray,
    even: EvenTimes,
) -> FloatArray:
    free = np.ones(weights.shape[1], dtype=bool)
    shares = {
        eye: _without_blinks(lowering(weights, apertures, free), even)
        for eye, apertures in by_eye.items()
    }
    if not one_shape_for_both(by_eye):
        shares = _alike(weights, by_eye, shares)
        for eye, apertures in by_eye.items():
            part = partial(_parted, share=shares[eye], even=even)
            weights = _without_crossing(weights, apertures, near_pins, part)
        return weights
    # Each eye from the same weights, or the second would be judged by what the first left of it.
    alone = [
        _without_crossing(
            weights, apertures, near_pins, partial(_parted, share=shares[eye], even=even)
        )
        for eye, apertures in by_eye.items()
    ]
    parted: FloatArray = np.min(alone, axis=0)
    closer = by_eye["left"].closer
    parted[:, closer] = np.max(alone, axis=0)[:, closer]
    # What brings one eye's upper lid down may have crossed the lids of the other.
    for apertures in by_eye.values():
        parted = _without_crossing(parted, apertures, near_pins, lower_until_parted)
    return parted


def _alike(
    weights: FloatArray, by_eye: Mapping[Eye, LidApertures], shares: Mapping[Eye, FloatArray]
) -> dict[Eye, FloatArray]:
    """Return the shares by which lower lids give way: of eyes that are shut alike, the larger.

    Hundredths of a millimetre between the two lids of a mesh decide whether an eye that is parted
    looks open.
    """
    if len(by_eye) < 2:
        return dict(shares)
    left, right = (_shut(weights, by_eye[eye]) for eye in EYES)
    together = (1.0 - np.abs(left - right).max(axis=1) / _UNLIKE).clip(min=0.0)
    most = np.maximum(*shares.values())
    return {eye: share + together * (most - share) for eye, share in shares.items()}


def _shut(weights: FloatArray, apertures: LidApertures) -> FloatArray:
    """Return how far closing shape, lower lid and cheek are up in an eye: (F, 3)."""
    groups = ([apertures.closer], apertures.tighteners, apertures.cheek_raisers)
    return np.stack([weights[:, list(own)].max(axis=1, initial=0.0) for own in groups], axis=1)


def _parted(
    weights: FloatArray,
    apertures: LidApertures,
    free: BoolArray,
    share: FloatArray,
    even: EvenTimes,
) -> FloatArray:
    """Return weights at which the lids do not cross, with pins from a share of their own."""
    if not free.all():
        share = _without_blinks(lowering(weights, apertures, free), even)
    return part_crossed_lids(weights, apertures, free, share, _frames(_GIVES_WAY, even), even)


def _without_blinks(share: FloatArray, even: EvenTimes) -> FloatArray:
    """Return the shares (F,) by which lower lids give way where an eye is shut for longer.

    A slit in a blink is not seen; cheeks that fall by millimetres in each blink of a smile are.
    """
    longest = _frames(LONGEST_BLINK, even)
    if longest < 2 or not share.any():
        return share
    shares = grey_closing(even.resampled(share), _frames(_GIVES_WAY, even), mode="nearest")
    held = even.of_frames(grey_opening(shares, longest, mode="nearest"))
    return np.asarray(np.minimum(share, held))


def _frames(duration: float, even: EvenTimes) -> int:
    """Return how many even times a duration [s] lasts; 0 in a take of one frame."""
    return round(duration / even.step) if even.step else 0


def _without_crossing(
    weights: FloatArray,
    apertures: LidApertures,
    near_pins: FloatArray,
    part: _Part,
) -> FloatArray:
    """Return weights at which the lids do not cross; pinned weights stay.

    Pins that reach into each other count together, so that nothing jumps where the reach of one
    ends; those of other frames do not.
    """
    near = near_pins[:, apertures.movers].max(axis=1, initial=0.0)
    parted = part(weights, apertures, np.ones(weights.shape[1], dtype=bool))
    parts: dict[bytes, FloatArray] = {}
    for first, last in frame_ranges(near > 0):
        own = slice(first, last + 1)
        held = near_pins[own].max(axis=0) > 0
        if held.tobytes() not in parts:
            parts[held.tobytes()] = part(weights, apertures, ~held)
        kept = parts[held.tobytes()][own]
        parted[own] += near[own, None] * (kept - parted[own])
    return parted


def _crossing(eye: Eye, apertures: LidApertures, weights: FloatArray) -> list[Finding]:
    depth = crossing(weights, apertures)
    frames = np.flatnonzero(depth > _REPORTED)
    if not len(frames):
        return []
    message = (
        "pinned weights make its lids cross in {frame_count} frames ({first_frame} to "
        "{last_frame}), by {depth_mm:.1f} mm at most"
    )
    return [
        finding(
            "LIDS_CROSS",
            f"{eye} eye",
            message,
            len(frames),
            frames[0],
            frames[-1],
            1000 * depth.max(),
        )
    ]


def _opened(
    eye: Eye,
    apertures: LidApertures,
    causes: Sequence[LidApertures],
    shut: FloatArray,
    parted: FloatArray,
) -> list[Finding]:
    """Report lids that were shut, and stay open in part where those that cross are parted.

    Or whose lower lid is lowered for it. Those that cross are of the `causes`.
    """
    frames = np.flatnonzero((shut != parted).any(axis=1))
    frames = frames[apertures.widest(shut[frames]) <= 0.0]
    left, raised = (
        apertures.widest(parted[frames]),
        [*apertures.tighteners, *apertures.cheek_raisers],
    )
    fallen = (shut[frames] - parted[frames])[:, raised].max(axis=1, initial=0.0)
    reported = (left > looks_open(apertures) + _EXACT) | (fallen > _FALLEN)
    frames, left, fallen = frames[reported], left[reported], fallen[reported]
    if not len(frames):
        return []
    message = (
        "shut in {frame_count} frames ({first_frame} to {last_frame}) by weights at which lids "
        "cross by up to {depth_mm:.1f} mm; parted, they stay open by up to {gap_mm:.1f} mm, with "
        "weights of the lower lid down by up to {weight:.2f}"
    )
    return [
        finding(
            "LIDS_PARTED",
            f"{eye} eye",
            message,
            len(frames),
            frames[0],
            frames[-1],
            -1000 * min(each.least(shut[frames]).min() for each in causes),
            1000 * left.max(),
            fallen.max(),
        )
    ]
