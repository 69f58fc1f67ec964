"""The skeleton of a rig, and how it skins a mesh."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError

__all__ = ["Skeleton", "Skin"]


@dataclass(frozen=True, eq=False, slots=True)
class Skin:
    """Skin influences of a mesh: `joints` (V, K) int64 into the skeleton, `weights` (V, K)."""

    joints: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "joints", dtype=np.int64)
        freeze(self, "weights")


@dataclass(frozen=True, eq=False, slots=True)
class Skeleton:
    """Joints that skin the meshes.

    Attributes
    ----------
    joints : tuple of str, length J
        UsdSkel joint paths ("root/neck/head"), parents before children.
    names : tuple of str, length J
        Original joint names.
    bind : (J, 4, 4) float64
        Joint to rig space at bind time; row vectors (USD's convention), metres.
    rest : (J, 4, 4) float64
        Joint to parent at rest; row vectors, metres.
    skin_name : str
        Name of the glTF skin that it was or will be, if it has one.
    """

    joints: tuple[str, ...]
    names: tuple[str, ...]
    bind: FloatArray
    rest: FloatArray
    skin_name: str = ""

    def __post_init__(self) -> None:
        freeze(self, "bind", "rest")
        shape = (len(self.joints), 4, 4)
        if self.bind.shape != shape or self.rest.shape != shape:
            raise InputError(f"the skeleton's transforms must have shape {shape}")

    @property
    def parents(self) -> tuple[int, ...]:
        """Index of the joint above each, which comes before it; -1 = none."""
        places = {joint: k for k, joint in enumerate(self.joints)}
        return tuple(places.get(joint.rpartition("/")[0], -1) for joint in self.joints)
