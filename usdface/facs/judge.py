"""Verdicts on blend shapes: the movement of each, against that of the unit that its name claims.

The displacement of the feature points by a shape is compared with every movement by the cosine
between them, the *fit*. Thresholds are those of the rig: another unit is taken seriously where it
fits better by more than this rig's shapes usually miss their own, beside the noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import nnls

from usdface.arrays import BoolArray, FloatArray
from usdface.facs.fits import SEEN, Fits, fits_of
from usdface.facs.shape_claims import Claim, claims_of

__all__ = ["ShapeVerdict", "ShapeVerdicts", "VerdictCode", "judge_shapes"]

VerdictCode = Literal[
    "done",
    "dead",
    "other_side",
    "swapped",
    "other_unit",
    "mixed",
    "not_done",
    "unnamed",
]

# Half as far as the main movement is a movement of its own, and no by-product: where a lip is
# raised, the cheek goes 0.45 of its way on ICT, the most of ICT, MakeHuman and the example.
_HALF = 0.5
# Least cosine of a movement; the worst right shape of the three has 0.59.
_LEAST = 0.3
# How far a shape misses its unit (1 - cosine): of half of a rig's shapes, and of nine in ten.
_USUAL, _LARGE = 50, 90


@dataclass(frozen=True, slots=True)
class ShapeVerdict:
    """The movement of a blend shape, compared with the one of its name.

    Attributes
    ----------
    name : str
    verdict : str
        ``"done"``; ``"dead"``: it moves nothing; ``"other_side"``: the mirror image of its name;
        ``"swapped"``: it has the movement of `partner`'s name, and the other way round;
        ``"other_unit"``: it has that of `shown`; ``"mixed"``: its own and `second`;
        ``"not_done"``: no known movement; ``"unnamed"``: its name claims no unit.
    claim : Claim or None
        The movement of its name.
    shown : Claim or None
        The movement that it makes.
    second : Claim or None
    partner : str
    fit, shown_fit : float
        Cosine between its displacements and those of `claim`, of `shown`.
    moved_mm : float [mm of a human head]
        How far the points of `claim` moved along its directions, those that move farther counting
        more; without a claim, those of `shown`.
    in_noise : float
        The same in standard deviations of the noise.
    largest_mm : float [mm of a human head]
        The largest displacement of any vertex.
    points : mapping of str to float [mm of a human head]
        How far each point of the movement moved along its direction.
    """

    name: str
    verdict: VerdictCode
    claim: Claim | None = None
    shown: Claim | None = None
    second: Claim | None = None
    partner: str = ""
    fit: float = 0.0
    shown_fit: float = 0.0
    moved_mm: float = 0.0
    in_noise: float = 0.0
    largest_mm: float = 0.0
    points: Mapping[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        claim, shown, second = (str(c) if c else "" for c in (self.claim, self.shown, self.second))
        return {
            "shape": self.name,
            "verdict": self.verdict,
            "unit": claim,
            "shown": shown,
            "second": second,
            "partner": self.partner,
            "fit": round(self.fit, 3),
            "shown_fit": round(self.shown_fit, 3),
            "moved_mm": round(self.moved_mm, 2),
            "in_noise": round(self.in_noise, 1),
            "largest_mm": round(self.largest_mm, 2),
            "points_mm": {point: round(value, 2) for point, value in self.points.items()},
        }


class ShapeVerdicts(NamedTuple):
    """The verdicts on a rig's shapes, and how far they miss their own units (1 - cosine).

    `usual` is the miss of half of them, `large` that of nine in ten.
    """

    verdicts: tuple[ShapeVerdict, ...]
    usual: float
    large: float
    fits: Fits


@dataclass(frozen=True, eq=False, slots=True)
class _Rig:
    """The rig's quantities that the verdicts on single shapes depend on.

    `usual` and `large` are misses of the rig's own shapes, `partners` its swapped ones.
    """

    fits: Fits
    noise: float
    usual: float
    large: float
    partners: Mapping[int, int]


def judge_shapes(
    names: Sequence[str], moved: FloatArray, largest: FloatArray, noise: float
) -> ShapeVerdicts:
    """Judge blend shapes by the units that their names claim.

    Parameters
    ----------
    names : sequence of str, length S
    moved : (S, P, 3) float64 [mm of a human head]
        Displacement of `usdface.facs.movements.POINTS` by each.
    largest : (S,) float64 [mm of a human head]
        The largest displacement of any vertex of the rig.
    noise : float [mm of a human head]
        Standard deviation of a coordinate; a shape that moves nothing farther is dead.

    Returns
    -------
    ShapeVerdicts
        In the order of `names`.
    """
    fits, claims = fits_of(moved), claims_of(names)
    alive = largest >= noise
    claimed = {i: claims[name] for i, name in enumerate(names) if name in claims}
    own = {i: fits.best(i, these) for i, these in claimed.items()}
    misses = [1.0 - fits.cosines[i, k] for i, k in own.items() if alive[i]]
    usual, large = np.percentile(misses or [0.0], (_USUAL, _LARGE)).tolist()
    rig = _Rig(fits, noise, usual, large, _swaps(fits, claimed, alive, usual))
    result = []
    for i, name in enumerate(names):
        verdict: VerdictCode = "dead"
        shown, second = None, None
        if alive[i]:
            verdict, shown, second = _judged(rig, i, own.get(i))
        if i in rig.partners:
            shown = fits.best(i, claimed[rig.partners[i]])
        judged = own.get(i, shown)
        reading = fits.reading(i, judged, noise) if judged is not None else None
        of = {k: fits.candidates[k] for k in (own.get(i), shown, second) if k is not None}
        at = {k: float(fits.cosines[i, k]) for k in of}
        result.append(
            ShapeVerdict(
                name=name,
                verdict=verdict,
                claim=of.get(own.get(i, -1)),
                shown=of.get(-1 if shown is None else shown),
                second=of.get(-1 if second is None else second),
                partner=names[rig.partners[i]] if i in rig.partners else "",
                fit=at.get(own.get(i, -1), 0.0),
                shown_fit=at.get(-1 if shown is None else shown, 0.0),
                moved_mm=reading.mean if reading else 0.0,
                in_noise=reading.in_noise if reading else 0.0,
                largest_mm=float(largest[i]),
                points=reading.points if reading else {},
            )
        )
    return ShapeVerdicts(tuple(result), usual, large, fits)


def _judged(rig: _Rig, shape: int, own: int | None) -> tuple[VerdictCode, int | None, int | None]:
    """Return the verdict on a shape that moves something, the movement it makes, and a second."""
    fit = rig.fits.cosines[shape]
    best = int(fit.argmax()) if fit.max() >= _LEAST else None
    if own is None:
        return "unnamed", best, None
    if shape in rig.partners:
        return "swapped", None, None
    mirror = rig.fits.mirror(own)
    if fit[mirror] > max(float(fit[own]), _LEAST):
        return "other_side", mirror, None
    size = float(np.linalg.norm(rig.fits.moved[shape]))
    margin = float(np.hypot(rig.usual, rig.noise / max(size, rig.noise)))
    if best is not None and fit[best] - fit[own] > margin:
        second = _second(rig, shape, best)
        return ("mixed" if second == own else "other_unit"), best, second
    if fit[own] < _LEAST or rig.fits.reading(shape, own, rig.noise).in_noise < SEEN:
        return "not_done", best, None
    second = _second(rig, shape, own)
    return ("done" if second is None else "mixed"), own, second


def _swaps(
    fits: Fits, claimed: Mapping[int, tuple[Claim, ...]], alive: BoolArray, usual: float
) -> dict[int, int]:
    """Return the shapes whose names are swapped, each with the one that has its movement.

    Both fit the other's name better than their own, and nearly as well as any movement. Of two
    units that are alike one shape may fit either name: the gain of the other decides, which is as
    large as the loss where the two shapes are the same.
    """
    shapes = [i for i in claimed if alive[i]]
    fit = {(i, j): float(fits.cosines[i, fits.best(i, claimed[j])]) for i in shapes for j in shapes}
    enough = fits.cosines.max(axis=1) - usual
    gains = [
        (one + other, i, j)
        for i, j in combinations(shapes, 2)
        for one, other in ((fit[i, j] - fit[i, i], fit[j, i] - fit[j, j]),)
        if (min(one, other) > 0.0 or (min(one, other) > -usual and one + other > usual))
        and fit[i, j] >= enough[i]
        and fit[j, i] >= enough[j]
    ]
    found: dict[int, int] = {}
    for _, i, j in sorted(gains, reverse=True):
        if i not in found and j not in found:
            found |= {i: j, j: i}
    return found


def _second(rig: _Rig, shape: int, main: int) -> int | None:
    """Return the movement that a shape makes besides `main`; None where there is none.

    One with points of its own counts where they go half as far as those of `main`; one that shares
    points, where both together fit better by more than nine in ten shapes miss their own unit.
    """
    fits = rig.fits
    moved, way, reach = fits.moved[shape], fits.ways[main], fits.reaches
    size = np.linalg.norm(moved)
    found, most = None, 0.0
    for k, other in enumerate(fits.ways):
        length = np.linalg.norm(other)
        if not length or fits.candidates[k].movement == fits.candidates[main].movement:
            continue
        amounts, rest = nnls(np.stack([way, other], axis=1), moved)
        if amounts[1] * length < SEEN * rig.noise:
            continue
        gain = np.sqrt(max(0.0, 1.0 - (rest / size) ** 2)) - max(fits.cosines[shape, main], 0.0)
        far = amounts[1] * reach[k] > _HALF * amounts[0] * reach[main]
        enough = far if fits.apart(main, k) else gain > rig.large
        if enough and gain > most:
            found, most = k, float(gain)
    return found
