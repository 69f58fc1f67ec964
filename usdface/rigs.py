"""Rigs: the character, as immutable arrays in metres, Y up, right-handed.

A `Rig` is the value of every rig reader and the input of every rig writer: meshes with blend
shapes, an optional skeleton that skins them, and simple materials.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray, frozen
from usdface.blend_shapes.blend_shape import (
    BlendShape,
    Combination,
    CombinationRule,
    Inbetween,
    offsets_at,
)
from usdface.errors import InputError
from usdface.materials import Material, Texture
from usdface.scene import Camera, Extras, Group, Light

__all__ = [
    "CORNER_NORMALS",
    "BlendShape",
    "Combination",
    "CombinationRule",
    "CornerValues",
    "Inbetween",
    "Material",
    "MaterialSubset",
    "MaterialVariant",
    "Mesh",
    "Rig",
    "Skeleton",
    "Skin",
    "Texture",
]


CORNER_NORMALS = "normals"

# Share of the shapes of the mesh that has the most: meshes with as many of them are parts of one
# face. Set by hand: a tongue with a dozen shapes beside all 51 of a head shares 0.81 of its shapes
# with it, a beard that only those of jaw, cheeks and mouth move 0.6 of the head's.
_SHARED = 0.75
_ALIKE = 0.9  # of the size of a face's moving part, at least, has another face


@dataclass(frozen=True, eq=False, slots=True)
class Skin:
    """Skin influences of a mesh: `joints` (V, K) int64 into the skeleton, `weights` (V, K)."""

    joints: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", frozen(self.joints, np.int64))
        object.__setattr__(self, "weights", frozen(self.weights))


@dataclass(frozen=True, eq=False, slots=True)
class MaterialSubset:
    """Faces of a mesh that carry one material: `faces` (N,) int64."""

    material: str
    faces: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "faces", frozen(self.faces, np.int64))


@dataclass(frozen=True, slots=True)
class MaterialVariant:
    """A material variant of a mesh: `materials` maps original materials to their replacements.

    Each mesh of a rig has all variants by `name`; one that changes nothing of it is empty.
    """

    name: str
    materials: Mapping[str, str]


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
        object.__setattr__(self, "values", frozen(self.values))


@dataclass(frozen=True, eq=False, slots=True)
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

    Examples
    --------
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> smile = usdface.BlendShape("smile", [2], [[0, 0.1, 0]])
    >>> usdface.Mesh("face", points, [3], [0, 1, 2], shapes=(smile,)).shape_names
    ('smile',)
    """

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

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points))
        object.__setattr__(self, "face_counts", frozen(self.face_counts, np.int64))
        object.__setattr__(self, "face_indices", frozen(self.face_indices, np.int64))
        for name in ("normals", "uvs"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name)))
        self._check()

    def _check(self) -> None:
        count = len(self.points)
        if self.points.shape != (count, 3) or not np.isfinite(self.points).all():
            raise InputError(
                f"mesh {self.name!r}: points must be finite, shape (vertices, 3)", "VALUES_WRONG"
            )
        if self.face_counts.sum() != len(self.face_indices):
            raise InputError(
                f"mesh {self.name!r}: face counts add up to {self.face_counts.sum()}, "
                f"but there are {len(self.face_indices)} face indices",
                "TOPOLOGY_DIFFERS",
            )
        if len(self.face_indices) and not (
            self.face_indices.min() >= 0 and self.face_indices.max() < count
        ):
            raise InputError(
                f"mesh {self.name!r}: a face index is outside 0 to {count - 1}", "TOPOLOGY_DIFFERS"
            )
        for given in self.corner_values:
            if given.values.ndim != 2 or len(given.values) != len(self.face_indices):
                raise InputError(
                    f"mesh {self.name!r}: {given.name!r} has {len(given.values)} values for "
                    f"{len(self.face_indices)} face corners"
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
    """

    joints: tuple[str, ...]
    names: tuple[str, ...]
    bind: FloatArray
    rest: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "bind", frozen(self.bind))
        object.__setattr__(self, "rest", frozen(self.rest))
        shape = (len(self.joints), 4, 4)
        if self.bind.shape != shape or self.rest.shape != shape:
            raise InputError(f"the skeleton's transforms must have shape {shape}")


@dataclass(frozen=True, eq=False, slots=True)
class Rig:
    """A character: meshes with blend shapes, maybe a skeleton, materials.

    Attributes
    ----------
    name : str
    meshes : tuple of Mesh
        Shapes of the same name on several meshes share one weight.
    skeleton : Skeleton or None
    materials : tuple of Material
    source : str
        File it was read from.
    cameras : tuple of Camera
    lights : tuple of Light
    extras, asset : mapping
        Custom data of users, of the scene and of the file.
    groups : tuple of Group
        Parents before children.
    joint_extras : mapping
        Custom data of users by path of the joint.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> rig.mesh("head").shape_names[:2] == rig.shape_names[:2]
    True
    """

    name: str
    meshes: tuple[Mesh, ...]
    skeleton: Skeleton | None = None
    materials: tuple[Material, ...] = field(default=())
    source: str = ""
    cameras: tuple[Camera, ...] = ()
    lights: tuple[Light, ...] = ()
    extras: Extras = field(default_factory=dict)
    asset: Extras = field(default_factory=dict)
    groups: tuple[Group, ...] = ()
    joint_extras: Mapping[str, Extras] = field(default_factory=dict)

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of all blend shapes, in order of first appearance."""
        return tuple(dict.fromkeys(n for mesh in self.meshes for n in mesh.shape_names))

    def face(self) -> Mesh:
        """Return the mesh that the most blend shapes move, or a larger one that they move, too.

        Lashes, teeth and a tongue carry a head's shapes, and may have some of their own: of the
        meshes with nearly all of those shapes it is the one of which they move the largest part.
        Clothes have other shapes.

        Raises
        ------
        InputError
            If no mesh has any.
        """
        first = max(self.meshes, key=_face_rank, default=None)
        if first is None or not first.shapes:
            raise InputError(
                f"the rig {self.source or self.name!r} has no blend shapes", "SHAPES_MISSING"
            )
        shared = _moving_shapes(first)
        parts = [m for m in self.meshes if len(shared & _moving_shapes(m)) >= _SHARED * len(shared)]
        return max(parts, key=_moved_size) if shared else first

    def mesh(self, name: str = "") -> Mesh:
        """Return the mesh of that name or path; without one, the face.

        Raises
        ------
        InputError
            If there is no such mesh, it has no blend shapes, or none was named and there are two
            faces.
        """
        if not name:
            return self._only_face()
        found = [m for m in self.meshes if name in (m.path, m.name)]
        if not found:
            known = ", ".join(m.path or m.name for m in self.meshes)
            raise InputError(
                f"the rig {self.name!r} has no mesh {name!r}; it has {known}", "MESH_UNKNOWN"
            )
        if not found[0].shapes:
            raise InputError(
                f"mesh {name!r} of the rig {self.name!r} has no blend shapes", "SHAPES_MISSING"
            )
        return found[0]

    def _only_face(self) -> Mesh:
        face = self.face()
        shapes, size = _moving_shapes(face), _ALIKE * _moved_size(face)
        faces = [
            mesh
            for mesh in self.meshes
            if mesh is face or (shapes == _moving_shapes(mesh) and _moved_size(mesh) >= size)
        ]
        if shapes and len(faces) > 1:  # as of two characters in one scene
            known = ", ".join(mesh.path or mesh.name for mesh in faces)
            raise InputError(
                f"the rig {self.name!r} has {len(faces)} faces ({known}); name one as "
                '"mesh" in the binding',
                "MESH_UNKNOWN",
            )
        return face


def _face_rank(mesh: Mesh) -> tuple[int, int, float]:
    return len(_moving_shapes(mesh)), len(mesh.shapes), _moved_size(mesh)


def _moved_size(mesh: Mesh) -> float:
    """Return the diagonal of the box around all points that blend shapes move [m]."""
    moved = np.zeros(len(mesh.points), dtype=bool)
    for shape in mesh.shapes:
        moved[shape.indices[shape.offsets.any(axis=1)]] = True
    return float(np.linalg.norm(np.ptp(mesh.points[moved], axis=0))) if moved.any() else 0.0


def _moving_shapes(mesh: Mesh) -> set[str]:
    """Return the blend shapes of a mesh that move something, inbetweens included."""
    return {
        s.name
        for s in mesh.shapes
        if s.offsets.any() or any(between.offsets.any() for between in s.inbetweens)
    }
