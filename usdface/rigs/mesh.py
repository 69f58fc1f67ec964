"""A polygon mesh with blend shapes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray, freeze
from usdface.blend_shapes.blend_shape import BlendShape, offsets_at
from usdface.errors import InputError
from usdface.rigs.corner_values import CornerValues
from usdface.rigs.material_subsets import MaterialSubset, MaterialVariant
from usdface.rigs.skeleton import Skin
from usdface.scene import Extras
from usdface.short_repr import short_repr

__all__ = ["Mesh"]


@checked
@dataclass(frozen=True, eq=False)  # no slots: `once_per_mesh` keeps values
class Mesh:
    """A polygon mesh with blend shapes, in the rig's space at rest.

    Attributes
    ----------
    name : str
    points : (V, 3) float64 [m]
        Neutral positions, Y up (skeleton space at bind time).
    face_counts : (P,) int64
        Corners of each face, counter-clockwise seen from outside.
    face_indices : (C,) int64
        Vertex of each corner, C = sum of `face_counts`.
    normals : (V, 3) float64 or None
        Unit vertex normals.
    uvs : (C, 2) float64 or None
        Texture coordinates per face corner, v up (USD's convention).
    shapes : tuple of BlendShape
    skin : Skin or None
    material : str
        Name of a material of the rig for all faces not in `subsets`; "" = none.
    subsets : tuple of MaterialSubset
    path : str
        Prim path where the mesh came from a USD stage, else "".
    uv_name : str
        Name of the texture coordinates `uvs`.
    corner_values : tuple of CornerValues
        Further texture coordinates, vertex colours, tangents; names are unique.
    extras : mapping
        Custom data of users.
    flat : bool
        Faces are lit flat, as both formats define a polygon mesh without normals.
    group : str
        Path of the group of the rig that it is in; "" = none.
    variants : tuple of MaterialVariant
    content_name : str
        Name of the mesh itself where it has another one than its node, as in glTF; "" = `name`.

    Examples
    --------
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> smile = usdface.BlendShape("smile", [2], [[0, 0.1, 0]])
    >>> usdface.Mesh("face", points, [3], [0, 1, 2], shapes=(smile,)).shape_names
    ('smile',)
    """

    __repr__ = short_repr

    name: str
    points: FloatArray
    face_counts: IntArray
    face_indices: IntArray
    normals: FloatArray | None = None
    uvs: FloatArray | None = None
    shapes: tuple[BlendShape, ...] = ()
    skin: Skin | None = None
    material: str = ""
    subsets: tuple[MaterialSubset, ...] = ()
    path: str = ""
    uv_name: str = "st"
    corner_values: tuple[CornerValues, ...] = ()
    extras: Extras = field(default_factory=dict)
    flat: bool = False
    group: str = ""
    variants: tuple[MaterialVariant, ...] = ()
    content_name: str = ""

    def __post_init__(self) -> None:
        freeze(self, "points", "normals", "uvs")
        freeze(self, "face_counts", "face_indices", dtype=np.int64)
        self._check()

    def _check(self) -> None:
        count = len(self.points)
        if self.points.shape != (count, 3) or not np.isfinite(self.points).all():
            raise InputError(
                f"mesh {self.name!r}: points must be finite, shape (vertices, 3)", "VALUES_WRONG"
            )
        corners = len(self.face_indices)
        for name, expected in (("normals", (count, 3)), ("uvs", (corners, 2))):
            given = getattr(self, name)
            if given is not None and given.shape != expected:
                raise InputError(
                    f"mesh {self.name!r}: {name} have shape {given.shape}; expected {expected}",
                    "VALUES_WRONG",
                )
        if self.face_counts.sum() != corners:
            raise InputError(
                f"mesh {self.name!r}: face counts add up to {self.face_counts.sum()}, "
                f"but there are {corners} face indices",
                "TOPOLOGY_DIFFERS",
            )
        if corners and not (self.face_indices.min() >= 0 and self.face_indices.max() < count):
            raise InputError(
                f"mesh {self.name!r}: a face index is outside 0 to {count - 1}", "TOPOLOGY_DIFFERS"
            )
        for corner in self.corner_values:
            if corner.values.ndim != 2 or len(corner.values) != corners:
                raise InputError(
                    f"mesh {self.name!r}: {corner.name!r} has {len(corner.values)} values for "
                    f"{corners} face corners"
                )
        names = [shape.name for shape in self.shapes]
        for shape in self.shapes:
            if len(shape.indices) and not (shape.indices[0] >= 0 and shape.indices[-1] < count):
                raise InputError(
                    f"mesh {self.name!r}, blend shape {shape.name!r}: "
                    f"a point index is outside 0 to {count - 1}",
                    "POINT_INDICES_OUTSIDE",
                )
            if not np.isfinite(shape.offsets).all():
                raise InputError(
                    f"mesh {self.name!r}, blend shape {shape.name!r}: offsets must be finite",
                    "VALUES_WRONG",
                )
        if len(set(names)) != len(names):
            twice = sorted({n for n in names if names.count(n) > 1})
            raise InputError(
                f"mesh {self.name!r} has blend shape {twice[0]!r} twice", "NAME_REPEATED"
            )

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields, without the values that `once_per_mesh` keeps."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __setstate__(self, state: Mapping[str, Any]) -> None:  # makes arrays read-only (`checked`)
        vars(self).update(state)

    @property
    def materials(self) -> tuple[str, ...]:
        """Names of the materials that its faces may show: its own, and those of its subsets."""
        return (self.material, *(subset.material for subset in self.subsets))

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the blend shapes, in order."""
        return tuple(shape.name for shape in self.shapes)

    def corners(self, name: str) -> FloatArray | None:
        """Return the corner values (C, K) of a name, None where there are none."""
        return next((c.values for c in self.corner_values if c.name == name), None)

    @property
    def uv_sets(self) -> dict[str, FloatArray]:
        """All texture coordinates (C, 2) by name, those of `uvs` first."""
        first = {} if self.uvs is None else {self.uv_name: self.uvs}
        return first | {c.name: c.values for c in self.corner_values if c.values.shape[1] == 2}

    def scaled(self, factor: float) -> "Mesh":
        """Return the mesh `factor` times as large, with its blend shapes; skinning is as it was."""
        shapes = tuple(shape.scaled(factor) for shape in self.shapes)
        return replace(self, points=factor * self.points, shapes=shapes)

    def offsets_at(self, vertices: IntArray) -> FloatArray:
        """Return the offsets of all shapes at some vertices: (S, len(vertices), 3) [m].

        Vertices may be repeated.
        """
        return offsets_at(self.shapes, vertices)
