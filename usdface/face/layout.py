"""The layout of a face: which shapes belong where, and where lips and lids touch.

`usdface shot` finds them on the rig and authors them, so that a shot can say otherwise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from usdface.arrays import FloatArray, IntArray, frozen
from usdface.errors import InputError
from usdface.face.antagonists import antagonists
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.mirror import SIDES, Side, sided_shapes
from usdface.face.regions import GAIN_REGIONS, GainRegion, shape_regions
from usdface.options import CONTACT_TOLERANCE
from usdface.retarget_setup import Expression
from usdface.rigs import Mesh

__all__ = ["FaceLayout", "find_layout", "split_poses"]

_NO_PAIRS = np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class FaceLayout:
    """Where the shapes of a rig are on its face.

    Attributes
    ----------
    left, right : tuple of str
        Shapes of the character's left and right half; all others are driven by both.
    regions : mapping of "brows", "eyes", "mouth" to tuple of str
        A shape belongs to one at most.
    antagonists : tuple of (str, str)
        Shapes that move the same skin in opposite directions.
    lips, lids : (P, 2) int64
        Pairs of vertices of the bound mesh, upper and lower, that touch where the lips (on the
        neutral face) or the lids (closed) do.
    tolerance : float [m]
        By how much a correction may part lips or lids that touch.
    """

    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    regions: Mapping[GainRegion, tuple[str, ...]] = field(default_factory=dict)
    antagonists: tuple[tuple[str, str], ...] = ()
    lips: IntArray = field(default_factory=_NO_PAIRS.copy)
    lids: IntArray = field(default_factory=_NO_PAIRS.copy)
    tolerance: float = CONTACT_TOLERANCE

    def __post_init__(self) -> None:
        object.__setattr__(self, "regions", MappingProxyType(dict(self.regions)))
        for name in ("lips", "lids"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64))
        _check_once("both sides", (self.left, self.right))
        _check_once("two regions", tuple(self.regions.values()))
        if not (np.isfinite(self.tolerance) and self.tolerance >= 0):
            raise InputError(f"the contact tolerance is {self.tolerance}; expected 0 or more")

    @property
    def sides(self) -> tuple[Side, ...]:
        """The sides that a system is evaluated for: halves only where a shape belongs to one."""
        return SIDES if self.left or self.right else ("both",)

    @property
    def shapes(self) -> tuple[str, ...]:
        """Every shape that is named, once."""
        pairs = (name for pair in self.antagonists for name in pair)
        regions = (name for listed in self.regions.values() for name in listed)
        return tuple(dict.fromkeys((*self.left, *self.right, *regions, *pairs)))


def _check_once(where: str, lists: Sequence[tuple[str, ...]]) -> None:
    names = [name for listed in lists for name in set(listed)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"blend shape {twice[0]!r} is in {where}; name it in one")


def find_layout(mesh: Mesh, expressions: Sequence[Expression], middle: float) -> FaceLayout:
    """Find the layout of a face on its mesh; `middle` [m] is x of the midline."""
    contacts = find_lip_lid_contacts(mesh)
    left, right = sided_shapes(mesh, middle)
    return FaceLayout(
        left,
        right,
        shape_regions(mesh, contacts),
        antagonists(mesh, expressions),
        contacts.lips,
        contacts.lids,
    )


def split_poses(
    poses: FloatArray, names: Sequence[str], parts: FaceLayout
) -> list[tuple[int, Side, GainRegion | None, FloatArray]]:
    """Cut expression poses into the parts that are driven on their own.

    Parameters
    ----------
    poses : (E, S) float64
    names : sequence of str, length S
    parts : FaceLayout

    Returns
    -------
    list of (int, str, str or None, (S,) float64)
        Expression; side ("left", "right" or "both"); region, None = no region; and the part of
        the pose. The parts of an expression add up to it; empty ones are left out.
    """
    side = {n: "left" for n in parts.left} | {n: "right" for n in parts.right}
    region = {name: where for where, listed in parts.regions.items() for name in listed}
    of_side = np.array([side.get(name, "both") for name in names])
    of_region = np.array([region.get(name, "") for name in names])
    cut = []
    for row, pose in enumerate(poses):
        for half in SIDES:
            for where in (None, *GAIN_REGIONS):
                part = np.where((of_side == half) & (of_region == (where or "")), pose, 0.0)
                if part.any():
                    cut.append((row, half, where, part))
    return cut
