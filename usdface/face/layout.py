"""The layout of a face: sides, regions, antagonists, contacts of lips and lids.

`usdface shot` finds it on the rig and authors it, so that a shot can override it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError
from usdface.face.antagonists import antagonists
from usdface.face.head_size import size_by_eyes
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.mirror import SIDES, Side, sided_shapes
from usdface.face.regions import GAIN_REGIONS, GainRegion, shape_regions
from usdface.frozen_mapping import FrozenMapping
from usdface.options import CONTACT_TOLERANCE
from usdface.rigs import Mesh
from usdface.setup.expression import Expression

__all__ = ["FaceLayout", "find_layout", "split_poses"]

_NO_PAIRS = np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class FaceLayout:
    """Sides, regions, antagonists and contacts of a face.

    Attributes
    ----------
    left, right : tuple of str
        Blend shapes of the character's left and right half; all others follow both.
    regions : mapping of "brows", "eyes", "mouth" to tuple of str
        A blend shape belongs to one at most.
    antagonists : tuple of (str, str)
        Blend shapes that move the same skin in opposite directions.
    lips, lids : (P, 2) int64
        Pairs of vertices of the bound mesh, upper and lower, that touch on the neutral face (lips)
        or in closed eyes (lids).
    tolerance : float [m] or None
        Largest gap that a correction may open between lips or lids in contact; None = half a
        millimetre on a human face.
    """

    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    regions: Mapping[GainRegion, tuple[str, ...]] = field(default_factory=dict)
    antagonists: tuple[tuple[str, str], ...] = ()
    lips: IntArray = field(default_factory=_NO_PAIRS.copy)
    lids: IntArray = field(default_factory=_NO_PAIRS.copy)
    tolerance: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "regions", FrozenMapping(self.regions))
        freeze(self, "lips", "lids", dtype=np.int64)
        _check_once("both sides", (self.left, self.right))
        _check_once("two regions", tuple(self.regions.values()))
        if self.tolerance is not None and not 0 <= self.tolerance < np.inf:
            raise InputError(f"the contact tolerance is {self.tolerance}; expected 0 or more")

    @property
    def sides(self) -> tuple[Side, ...]:
        """The sides that a system is evaluated for: halves only if a blend shape belongs to one."""
        return SIDES if self.left or self.right else ("both",)

    @property
    def shapes(self) -> tuple[str, ...]:
        """Every named blend shape, once."""
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
    size = size_by_eyes(mesh.points, contacts.lids)
    return FaceLayout(
        left,
        right,
        shape_regions(mesh, contacts),
        antagonists(mesh, expressions),
        contacts.lips,
        contacts.lids,
        CONTACT_TOLERANCE * (size if size > 0.0 else 1.0),
    )


def split_poses(
    poses: FloatArray, names: Sequence[str], layout: FaceLayout
) -> list[tuple[int, Side, GainRegion | None, FloatArray]]:
    """Split expression poses into the parts with a side and a gain of their own.

    Parameters
    ----------
    poses : (E, S) float64
    names : sequence of str, length S
    layout : FaceLayout

    Returns
    -------
    list of (int, str, str or None, (S,) float64)
        Expression; side ("left", "right" or "both"); region, None = no region; and the part of
        the pose. The parts of an expression add up to it; empty ones are left out.
    """
    side = dict.fromkeys(layout.left, "left") | dict.fromkeys(layout.right, "right")
    region = {
        name: region_name for region_name, listed in layout.regions.items() for name in listed
    }
    of_side = np.array([side.get(name, "both") for name in names])
    of_region = np.array([region.get(name, "") for name in names])
    parts = []
    for row, pose in enumerate(poses):
        for half in SIDES:
            for region_name in (None, *GAIN_REGIONS):
                part = np.where((of_side == half) & (of_region == (region_name or "")), pose, 0.0)
                if part.any():
                    parts.append((row, half, region_name, part))
    return parts
