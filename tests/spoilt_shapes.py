"""Blend shapes of a rig swapped, mirrored, silenced and mixed, on all its meshes."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from usdface.blend_shapes.blend_shape import BlendShape
from usdface.rigs import Mesh, Rig

__all__ = ["mirrored", "mixed", "renamed", "silenced"]


def renamed(rig: Rig, names: dict[str, str]) -> Rig:
    """The rig with blend shapes under other names."""
    return _with(rig, lambda mesh, s: replace(s, name=names.get(s.name, s.name)))


def silenced(rig: Rig, name: str) -> Rig:
    return _with(rig, lambda mesh, s: replace(s, offsets=0.0 * s.offsets) if s.name == name else s)


def mirrored(rig: Rig, name: str, middle: float = 0.0) -> Rig:
    """The rig with a shape that does the same on the other half."""

    def turned(mesh: Mesh, shape: BlendShape) -> BlendShape:
        if shape.name != name:
            return shape
        image = mesh.points * (-1, 1, 1) + (2 * middle, 0, 0)
        partner = cKDTree(mesh.points).query(image)[1]
        dense = np.zeros_like(mesh.points)
        dense[shape.indices] = shape.offsets
        return BlendShape.from_dense(name, dense[partner] * (-1, 1, 1))

    return _with(rig, turned)


def mixed(rig: Rig, name: str, other: str) -> Rig:
    """The rig with a shape that also does what another one does."""

    def sum_of(mesh: Mesh, shape: BlendShape) -> BlendShape:
        if shape.name != name:
            return shape
        dense = np.zeros_like(mesh.points)
        for one in mesh.shapes:
            if one.name in (name, other):
                dense[one.indices] += one.offsets
        return BlendShape.from_dense(name, dense)

    return _with(rig, sum_of)


def _with(rig: Rig, change) -> Rig:
    meshes = (replace(m, shapes=tuple(change(m, s) for s in m.shapes)) for m in rig.meshes)
    return replace(rig, meshes=tuple(meshes))
