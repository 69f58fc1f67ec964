"""Material subsets of a mesh: the faces that carry each material, in each variant."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import IntArray, freeze

__all__ = ["MaterialSubset", "MaterialVariant"]


@dataclass(frozen=True, eq=False, slots=True)
class MaterialSubset:
    """Faces of a mesh that carry one material: `faces` (N,) int64."""

    material: str
    faces: IntArray

    def __post_init__(self) -> None:
        freeze(self, "faces", dtype=np.int64)


@dataclass(frozen=True, slots=True)
class MaterialVariant:
    """A material variant of a mesh: `materials` maps original materials to their replacements.

    Each mesh of a rig has all variants by `name`; one that changes nothing of it is empty.
    """

    name: str
    materials: Mapping[str, str]
