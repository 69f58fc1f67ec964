"""Shape keys within a vertex group, or relative to another key, as Blender shows them.

Blender exports the difference of every key to the basis, everywhere: a smile that a vertex group
keeps to the left would be one of both sides.
"""

import bpy
import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, Vt

from .character import key_names, usd_name
from .usd_setup import mesh_prim


def show_keys_as_blender(stage: Usd.Stage, meshes: list[bpy.types.Object]) -> None:
    """Give the blend shapes of exported meshes the offsets of their keys in Blender.

    They are made of those that Blender exported, in whatever unit and axes.
    """
    for mesh in meshes:
        prim = mesh_prim(stage, mesh.name, usd_name(mesh.name)) if key_names(mesh) else None
        if prim is not None:
            _correct(prim, mesh)


def _correct(prim: Usd.Prim, mesh: bpy.types.Object) -> None:
    keys = mesh.data.shape_keys
    count = len(UsdGeom.Mesh(prim).GetPointsAttr().Get(Usd.TimeCode.EarliestTime()) or ())
    if count != len(mesh.data.vertices):
        return
    targets = UsdSkel.BindingAPI(prim).GetBlendShapeTargetsRel().GetTargets()
    shapes = {path.name: UsdSkel.BlendShape.Get(prim.GetStage(), path) for path in targets}
    exported = {name: _dense(shape, count) for name, shape in shapes.items()}
    for key in keys.key_blocks:
        name, group = usd_name(key.name), mesh.vertex_groups.get(key.vertex_group)
        base = key.relative_key
        if name not in shapes or (group is None and base in (keys.reference_key, key)):
            continue
        offsets = exported[name] - exported.get(usd_name(base.name), 0.0)
        if group is not None:
            offsets = offsets * _weights(mesh, group.index)[:, None]
        moved = np.flatnonzero(offsets.any(axis=1))
        shapes[name].GetOffsetsAttr().Set(Vt.Vec3fArray.FromNumpy(offsets[moved].astype("f")))
        shapes[name].CreatePointIndicesAttr(Vt.IntArray.FromNumpy(moved.astype("i")))


def _dense(shape: UsdSkel.BlendShape, count: int) -> np.ndarray:
    """Return the offsets of all points: (V, 3)."""
    offsets = np.array(shape.GetOffsetsAttr().Get() or (), float).reshape(-1, 3)
    indices = shape.GetPointIndicesAttr().Get()
    dense = np.zeros((count, 3))
    dense[np.array(indices) if indices else slice(len(offsets))] = offsets
    return dense


def _weights(mesh: bpy.types.Object, group: int) -> np.ndarray:
    """Return the weights (V,) of a vertex group."""
    weights = np.zeros(len(mesh.data.vertices))
    for vertex in mesh.data.vertices:
        for element in vertex.groups:
            if element.group == group:
                weights[vertex.index] = element.weight
    return weights
