"""Numbers at the face corners of a mesh: texture coordinates, colours, tangents, hard normals."""

from dataclasses import dataclass

from usdface.arrays import FloatArray, freeze

__all__ = ["CORNER_NORMALS", "CornerValues"]

CORNER_NORMALS = "normals"


@dataclass(frozen=True, eq=False, slots=True)
class CornerValues:
    """Numbers at the face corners of a mesh: `values` (C, K) float64 under a primvar's name.

    Texture coordinates have K = 2; ``displayColor`` 3, or 4 with its opacity (linear, 0 to 1);
    ``tangents`` 4: a unit vector and the sign of the bitangent; ``normals`` 3: those of a mesh with
    hard edges.
    """

    name: str
    values: FloatArray

    def __post_init__(self) -> None:
        freeze(self, "values")
