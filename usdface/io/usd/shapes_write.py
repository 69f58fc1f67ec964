"""Blend shapes as prims of UsdSkel, with their inbetweens and normal offsets."""

from collections.abc import Callable
from functools import cache

import numpy as np
from pxr import UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.vertex_normals import NormalsNear
from usdface.io.prim_names import prim_names
from usdface.io.usd.blend_shapes import LABEL
from usdface.io.usd.combinations import write_combination
from usdface.io.usd.value_arrays import vec3f_array
from usdface.rigs import BlendShape, Mesh

__all__ = ["write_shapes"]


def write_shapes(prim: UsdGeom.Mesh, mesh: Mesh, names: tuple[str, ...]) -> list[Finding]:
    """Define the blend shapes of a mesh below its prim, and bind them to it.

    Normal offsets that they lack are the change of smooth normals.

    Parameters
    ----------
    prim : UsdGeom.Mesh
    mesh : Mesh
    names : tuple of str, length S
        Legal, unique prim names of the shapes.
    """
    if not mesh.shapes:
        return []
    stage, path = prim.GetPrim().GetStage(), prim.GetPath()
    findings: list[Finding] = []
    near = cache(
        lambda: NormalsNear(mesh.face_counts, mesh.face_indices, len(mesh.points))
    )  # most meshes bring their normal offsets and need none of this
    targets = [path.AppendChild(name) for name in names]
    for target, shape in zip(targets, mesh.shapes, strict=True):
        made = UsdSkel.BlendShape.Define(stage, target)
        if target.name != shape.name:
            made.GetPrim().SetDisplayName(shape.label or shape.name)
            findings.append(finding("NAME_CHANGED", str(target), "was {original!r}", shape.name))

        if shape.label:
            made.GetPrim().SetCustomDataByKey(LABEL, shape.label)

        def turned(offsets: FloatArray, shape: BlendShape = shape) -> FloatArray:
            points = mesh.points.copy()
            points[shape.indices] += offsets
            resting = near().at(mesh.points, shape.indices)
            return near().at(points, shape.indices) - resting

        normal_offsets = shape.normal_offsets
        if normal_offsets is None and not mesh.flat:
            normal_offsets = turned(shape.offsets)
        made.CreateOffsetsAttr(vec3f_array(shape.offsets))
        if normal_offsets is not None:
            made.CreateNormalOffsetsAttr(vec3f_array(normal_offsets))
        made.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(shape.indices.astype(np.int32)))
        findings += _write_inbetweens(made, shape, None if mesh.flat else turned)
        write_combination(made.GetPrim(), shape.combination)
    binding = UsdSkel.BindingAPI(prim)
    binding.CreateBlendShapesAttr(mesh.shape_names)
    binding.CreateBlendShapeTargetsRel().SetTargets(targets)
    return findings


def _write_inbetweens(
    made: UsdSkel.BlendShape,
    shape: BlendShape,
    turned: Callable[[FloatArray], FloatArray] | None,
) -> list[Finding]:
    findings: list[Finding] = []
    weights = {0.0, 1.0}
    names = prim_names(between.name for between in shape.inbetweens)
    for name, between in zip(names, shape.inbetweens, strict=True):
        if between.weight in weights:
            message = "inbetween {inbetween!r}: weight {weight:g} is taken already"
            findings.append(
                finding(
                    "INBETWEEN_DROPPED", str(made.GetPath()), message, between.name, between.weight
                )
            )
            continue
        weights.add(between.weight)
        target = made.CreateInbetween(name)
        target.SetWeight(between.weight)
        target.SetOffsets(vec3f_array(between.offsets))
        normal_offsets = between.normal_offsets
        if normal_offsets is None and turned is not None:
            normal_offsets = turned(between.offsets)
        if normal_offsets is not None:
            target.CreateNormalOffsetsAttr(vec3f_array(normal_offsets))
        if name != between.name:
            target.GetAttr().SetDisplayName(between.name)
    return findings
