"""Verdicts on expression poses and frames of a take: the action units above the noise.

A pose adds units up, so that they may hide each other: raised inner brows beside lowered brows. So
the displacements are explained by all units of the pose together, by non-negative least squares;
the amount of a unit is the displacement of its farthest point.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import nnls

from usdface.arrays import FloatArray
from usdface.face.expression_poses import EMOTIONS
from usdface.facs.fits import SEEN, Fits, fits_of

__all__ = ["PAPER_CRITERIA", "PoseVerdict", "UnitAmount", "judge_pose", "units_expected"]

# By which action units the poses of six emotions are judged in Troy, Pranowo, Gunanto, "2D to 3D
# Space Transformation for Facial Animation Based on Marker Data", InAES 2016; one of the
# alternatives is enough. Lips press together by tightener or pressor; in disgust the nose wrinkler
# raises the upper lip by itself.
PAPER_CRITERIA: Mapping[str, tuple[tuple[str, ...], ...]] = MappingProxyType(
    {
        "anger": (("23",), ("24",)),
        "disgust": (("9",), ("10",)),
        "joy": (("12",),),
        "sadness": (("1", "4", "15"),),
        "fear": (("1", "2", "4"),),
        "surprise": (("1", "2"), ("10",)),
    }
)
# Movements of units that have parts or other numbers here.
_PARTS = {"27": ("26",), "28": ("28 lower", "28 upper"), "23": ("23", "24"), "24": ("24", "23")}


class UnitAmount(NamedTuple):
    """Displacement of a unit's farthest point [mm of a human head], and in deviations of noise."""

    unit: str
    mm: float
    in_noise: float

    @property
    def done(self) -> bool:
        """Whether the movement is above the noise."""
        return self.in_noise >= SEEN


@dataclass(frozen=True, slots=True)
class PoseVerdict:
    """The action units of a pose.

    Attributes
    ----------
    name : str
    expected : tuple of UnitAmount
        The units that the pose should show; "23" holds also as "24", because blend shapes of
        pressed lips are drawn as either.
    others : tuple of UnitAmount
        Additional units, those that explain most first.
    criteria : bool or None
        Whether one set of units of `PAPER_CRITERIA` is done; None of an emotion without.
    """

    name: str
    expected: tuple[UnitAmount, ...]
    others: tuple[UnitAmount, ...] = ()
    criteria: bool | None = None

    @property
    def missing(self) -> tuple[str, ...]:
        """The expected units that are not above the noise."""
        return tuple(amount.unit for amount in self.expected if not amount.done)

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        rows = [
            {
                "unit": amount.unit,
                "verdict": "done" if amount.done else "not_done",
                "moved_mm": round(amount.mm, 2),
                "in_noise": round(amount.in_noise, 1),
            }
            for amount in self.expected
        ]
        others = [
            {"unit": a.unit, "moved_mm": round(a.mm, 2), "in_noise": round(a.in_noise, 1)}
            for a in self.others
        ]
        return {"pose": self.name, "units": rows, "others": others, "criteria": self.criteria}


def units_expected(emotion: str) -> tuple[str, ...]:
    """Return the units of an emotion's FACS prototype; () without one."""
    return tuple(str(unit) for unit in EMOTIONS.get(emotion, ()))


def judge_pose(
    name: str, moved: FloatArray, units: Sequence[str], noise: float, large: float
) -> PoseVerdict:
    """Judge the displacements of a pose by the units that it should show.

    Parameters
    ----------
    name : str
        An emotion of `PAPER_CRITERIA` is also judged by these.
    moved : (P, 3) float64 [mm of a human head]
        Displacement of `usdface.facs.movements.POINTS`; 0 of points without a measurement.
    units : sequence of str
        Names of movements, without a side.
    noise : float [mm of a human head]
    large : float
        Least gain of the fit (cosine) for another unit to be named.
    """
    fits = fits_of(moved[None])
    whole = {c.movement: k for k, c in enumerate(fits.candidates) if not c.side}
    criteria = PAPER_CRITERIA.get(name, ())
    judged = dict.fromkeys((*units, *(unit for some in criteria for unit in some)))
    parts = dict.fromkeys(part for unit in judged for part in _PARTS.get(unit, (unit,)))
    pose = _Explained.by(fits, {part: whole[part] for part in parts if part in whole}, noise)
    expected = tuple(pose.amount(unit) for unit in units)
    done = any(all(pose.amount(unit).done for unit in some) for some in criteria)
    others: list[str] = []
    while len(pose.columns) < len(whole):
        extended = [
            (_Explained.by(fits, {**pose.columns, unit: k}, noise), unit)
            for unit, k in whole.items()
            if unit not in pose.columns
        ]
        better, unit = max(extended, key=lambda one: one[0].fit)
        if better.fit - pose.fit <= large or not better.amount(unit).done:
            break
        pose = better
        others.append(unit)
    return PoseVerdict(name, expected, tuple(map(pose.amount, others)), done if criteria else None)


@dataclass(frozen=True, eq=False, slots=True)
class _Explained:
    """Displacements as a sum of movements: the `columns` of the fits, their amounts, the fit."""

    columns: Mapping[str, int]
    amounts: Mapping[str, UnitAmount]
    fit: float

    @classmethod
    def by(cls, fits: Fits, columns: Mapping[str, int], noise: float) -> "_Explained":
        """Return the least-squares amounts, 0 and more."""
        size = float(np.linalg.norm(fits.moved[0]))
        chosen = list(columns.values())
        if not size or not chosen:
            return cls(columns, {}, 0.0)
        found, rest = nnls(fits.ways[chosen].T, fits.moved[0])
        lengths = np.linalg.norm(fits.ways[chosen], axis=1)
        amounts = {
            unit: UnitAmount(unit, float(value * reach), float(value * length) / noise)
            for unit, value, reach, length in zip(
                columns, found, fits.reaches[chosen], lengths, strict=True
            )
        }
        return cls(columns, amounts, float(np.sqrt(max(0.0, 1.0 - (rest / size) ** 2))))

    def amount(self, unit: str) -> UnitAmount:
        """Return the amount of a unit; of one with parts, the largest of these."""
        parts = [self.amounts[p] for p in _PARTS.get(unit, (unit,)) if p in self.amounts]
        best = max(parts, key=lambda one: one.in_noise, default=UnitAmount(unit, 0.0, 0.0))
        return best._replace(unit=unit)
