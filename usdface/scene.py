"""The scene around a character: cameras, lights and groups, in metres, Y up, SI units of light."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from usdface.arrays import FloatArray, freeze

__all__ = ["Camera", "Extras", "Group", "Light", "LightKind"]

Extras = Mapping[str, Any]  # user data: JSON values by name
LightKind = Literal["directional", "point", "spot"]


@dataclass(frozen=True, eq=False, slots=True)
class Camera:
    """A camera that looks along its -Z.

    Attributes
    ----------
    name : str
    matrix : (4, 4) float64
        Camera to rig space; row vectors.
    height : float
        Perspective: angle from bottom to top [rad]. Orthographic: from bottom to top [m].
    aspect : float
        Width over height; 0 = that of the window.
    near, far : float [m]
        `far` may be infinite.
    perspective : bool
    extras : mapping
    content_name : str
        Name of the camera itself where it has another one than its node, as in glTF; "" = `name`.
    """

    name: str
    matrix: FloatArray
    height: float
    aspect: float = 0.0
    near: float = 0.1
    far: float = float("inf")
    perspective: bool = True
    extras: Extras = field(default_factory=dict)
    content_name: str = ""

    def __post_init__(self) -> None:
        freeze(self, "matrix")


@dataclass(frozen=True, eq=False, slots=True)
class Light:
    """A light that shines along its -Z, or to all sides.

    Attributes
    ----------
    name : str
    kind : {"directional", "point", "spot"}
    matrix : (4, 4) float64
        Light to rig space; row vectors.
    colour : (float, float, float)
        Linear, 0 to 1.
    intensity : float
        Directional: illuminance [lx]. Others: luminous intensity [cd].
    inner, outer : float [rad]
        Of a spot: angles from its axis at which light begins and ends to fade.
    reach : float [m]
        Where the light ends; infinite = nowhere.
    extras : mapping
    content_name : str
        As of `Camera`.
    """

    name: str
    kind: LightKind
    matrix: FloatArray
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    inner: float = 0.0
    outer: float = 0.7853981633974483
    reach: float = float("inf")
    extras: Extras = field(default_factory=dict)
    content_name: str = ""

    def __post_init__(self) -> None:
        freeze(self, "matrix")


@dataclass(frozen=True, eq=False, slots=True)
class Group:
    """A node without content: a group, an attachment point, a bone without skin.

    Attributes
    ----------
    path : str
        Of prim names, as of joints: the group "body/hat" is in the group "body".
    name : str
        Any text.
    matrix : (4, 4) float64
        Group to rig space at rest; row vectors.
    joint : str
        Path of the joint of the rig that is its parent; "" = none. Only for a group that is in no
        other.
    extras : mapping
    """

    path: str
    name: str
    matrix: FloatArray
    joint: str = ""
    extras: Extras = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "matrix")
