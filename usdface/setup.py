"""The setup of one face: which marker sits where on the rig, and how the take is solved."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from usdface.errors import InputError
from usdface.options import HeadMode, MapOptions, SolveOptions
from usdface.takes import FloatArray, IntArray, frozen

__all__ = ["Binding", "Expression", "Setup"]


@dataclass(frozen=True, eq=False, slots=True)
class Binding:
    """Where markers sit on the rig: `markers[i]` on vertex `points[i]` of `mesh`.

    `mesh` is a mesh name or prim path; "" = the only mesh of the rig that has shapes.
    """

    markers: tuple[str, ...]
    points: IntArray
    mesh: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.int64))
        if len(set(self.markers)) != len(self.markers):
            raise InputError("the binding names a marker twice")
        if self.points.shape != (len(self.markers),):
            raise InputError(
                f"the binding has {self.points.size} points for {len(self.markers)} markers"
            )


@dataclass(frozen=True, eq=False, slots=True)
class Expression:
    """One key shape of the rig as weights of its blend shapes: an expression pose."""

    name: str
    shapes: tuple[str, ...]
    weights: FloatArray
    gain: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", frozen(self.weights))
        if self.weights.shape != (len(self.shapes),):
            raise InputError(
                f"expression {self.name!r} has {self.weights.size} weights "
                f"for {len(self.shapes)} shapes"
            )
        if not ((self.weights >= 0) & (self.weights <= 1)).all():
            raise InputError(f"expression {self.name!r}: weights must lie in [0, 1]")

    def pose(self, names: tuple[str, ...]) -> FloatArray:
        """Return the weights in the order of `names`: (len(names),); others are left out."""
        own = dict(zip(self.shapes, self.weights, strict=True))
        return np.array([own.get(name, 0.0) for name in names])


@dataclass(frozen=True, eq=False, slots=True)
class Setup:
    """Everything `retarget` needs to know about a face besides take and rig.

    Attributes
    ----------
    binding : Binding
    head : {"solve", "markers", "stabilised"}
        "solve": the head pose is found together with the weights. "markers": a rigid fit
        on `head_markers`, which sit on something truly rigid. "stabilised": no head motion.
    neutral : (int, int) or None
        First and last neutral frame index, inclusive; None = the take's neutral is the
        rig's own neutral mesh, in the same space.
    nose_tip : str
        Marker that the fuzzy system measures distances to; "" = none.
    roles : mapping of str to str
        Role name (as in "lip_lower_y") to marker name.
    """

    binding: Binding
    head: HeadMode = "solve"
    head_markers: tuple[str, ...] = ()
    neutral: tuple[int, int] | None = (0, 0)
    nose_tip: str = ""
    roles: Mapping[str, str] = field(default_factory=dict)
    map: MapOptions = field(default_factory=MapOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)

    def __post_init__(self) -> None:
        object.__setattr__(self, "roles", MappingProxyType(dict(self.roles)))
        if self.head == "markers" and len(self.head_markers) < 3:
            raise InputError(
                f"the head needs at least three rigid markers; got {len(self.head_markers)}. "
                'Name more, or use "solve"'
            )
