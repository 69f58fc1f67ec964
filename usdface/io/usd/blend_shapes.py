"""Blend shapes of a USD mesh, sparse or dense, as usdface's sorted sparse ones."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdSkel

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.face.shape_aliases import is_counted
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.usd.combinations import read_combination
from usdface.io.usd.value_arrays import vectors_of
from usdface.rigs import BlendShape, Inbetween

__all__ = ["LABEL", "blend_shape_at", "read_shapes"]

LABEL = "usdface:label"  # of customData: the name where it is not the token

# Offsets, normal offsets, then the same of each inbetween: columns that share point indices.
_Columns = NDArray[np.float64]


def read_shapes(
    prim: Usd.Prim, vectors: FloatArray, normals: FloatArray, lengths: FloatArray
) -> tuple[tuple[BlendShape, ...], list[Finding]]:
    """Return the blend shapes bound to the mesh `prim`.

    The names are the tokens of `skel:blendShapes`. As UsdSkel evaluates them (measured on
    26.11): offsets at a repeated point index add up; of two targets with one token the
    first gets the weight; out-of-range indices and lists of unequal length apply nothing.

    Parameters
    ----------
    prim : Usd.Prim
        A mesh with SkelBindingAPI properties.
    vectors, normals : (3, 3) float64
        Matrices of offsets and of normal offsets (row vectors).
    lengths : (V,) float64
        Lengths of the mesh's normals under that matrix: USD adds offsets to them before they get
        unit length, so offsets of unit normals are divided by them.

    Raises
    ------
    InputError
        If names and targets differ in number: which target a weight moves is then unknown.
    """
    binding = UsdSkel.BindingAPI(prim)
    tokens = [str(token) for token in binding.GetBlendShapesAttr().Get() or ()]
    relation = binding.GetBlendShapeTargetsRel()
    targets = relation.GetForwardedTargets() if relation else []
    if len(tokens) != len(targets):
        raise InputError(
            f"{prim.GetPath()} has {len(tokens)} skel:blendShapes names for {len(targets)} "
            "skel:blendShapeTargets; give each target one name"
        )
    shapes: dict[str, BlendShape] = {}
    findings: list[Finding] = []
    for token, target in zip(tokens, targets, strict=True):
        where = str(target)
        shape = blend_shape_at(prim.GetStage(), target)
        if not shape:
            message = "{mesh} names a blend shape that does not exist or is inactive"
            findings.append(finding("SHAPE_TARGET_MISSING", where, message, prim.GetPath()))
        elif token in shapes:
            message = "a second target for {shape!r} on {mesh} is left out"
            findings.append(finding("SHAPE_SKIPPED", where, message, token, prim.GetPath()))
        else:
            found, new_findings = _read_shape(shape, token, len(lengths))
            findings += new_findings
            if found is not None:
                combination, new_findings = read_combination(shape.GetPrim())
                findings += new_findings
                label = _label(shape.GetPrim(), token, tokens)
                found = replace(found, label=label, combination=combination)
                shapes[token] = _in_rig_space(found, vectors, normals, lengths)
    return tuple(shapes.values()), findings


def blend_shape_at(stage: Usd.Stage, path: Sdf.Path) -> UsdSkel.BlendShape:
    """Return the active blend shape at a path; an invalid one where there is none.

    UsdSkel moves another shape by the weight of an inactive one (measured on 26.11).
    """
    prim = stage.GetPrimAtPath(path)
    return UsdSkel.BlendShape(prim if prim and prim.IsActive() else Usd.Prim())


def _label(shape: Usd.Prim, token: str, tokens: Sequence[str]) -> str:
    """Return the name that a blend shape had before its token was made unique, or ""."""
    noted = shape.GetCustomDataByKey(LABEL)
    if isinstance(noted, str):
        return noted
    own = str(shape.GetName())
    return own if is_counted(token, own) and own not in tokens else ""


def _read_shape(
    shape: UsdSkel.BlendShape, name: str, count: int
) -> tuple[BlendShape | None, list[Finding]]:
    where = str(shape.GetPath())

    def skipped(why: str) -> tuple[None, list[Finding]]:
        message = "blend shape {shape!r} {why}; left out"
        return None, [finding("SHAPE_SKIPPED", where, message, name, Prose(why))]

    indices: IntArray = np.asarray(shape.GetPointIndicesAttr().Get() or [], np.int64)
    offsets = vectors_of(shape.GetOffsetsAttr().Get())
    normal_offsets = vectors_of(shape.GetNormalOffsetsAttr().Get())
    size = len(indices) or len(offsets) or len(normal_offsets)
    if not size:
        return BlendShape(name, indices, np.zeros((0, 3))), [finding("SHAPE_EMPTY", where)]
    sparse = bool(len(indices))
    if not sparse and size != count:
        return skipped(f"has {size} offsets and no point indices for {count} points")
    if len(offsets) not in (0, size) or len(normal_offsets) not in (0, size):
        return skipped(
            f"has {len(offsets)} offsets and {len(normal_offsets)} normal offsets for {size} points"
        )
    if sparse and not 0 <= indices.min() <= indices.max() < count:
        return skipped(f"has a point index outside 0 to {count - 1}")
    between, findings = _read_inbetweens(shape, size)
    columns = [_zeros_if_empty(offsets, size), _zeros_if_empty(normal_offsets, size)]
    for _, _, moved, turned in between:
        columns += [_zeros_if_empty(moved, size), _zeros_if_empty(turned, size)]
    table = np.stack(columns, axis=1)
    if not np.isfinite(table).all():
        return skipped("has offsets that are not finite numbers")
    if sparse:
        indices, table, new_findings = _sorted(indices, table, where)
        findings += new_findings
    else:
        indices = np.flatnonzero(table.any(axis=(1, 2)))
        table = table[indices]
    if not table.any():
        findings.append(finding("SHAPE_EMPTY", where))
    inbetweens = tuple(
        Inbetween(label, weight, table[:, 2 + 2 * i], table[:, 3 + 2 * i] if len(turned) else None)
        for i, (label, weight, _, turned) in enumerate(between)
    )
    bent = table[:, 1] if len(normal_offsets) else None
    return BlendShape(name, indices, table[:, 0], bent, inbetweens), findings


def _zeros_if_empty(offsets: FloatArray, size: int) -> FloatArray:
    return offsets if len(offsets) else np.zeros((size, 3))


def _read_inbetweens(
    shape: UsdSkel.BlendShape, size: int
) -> tuple[list[tuple[str, float, FloatArray, FloatArray]], list[Finding]]:
    """Return name, weight, offsets and normal offsets (empty if none) of the usable ones."""
    found: list[tuple[str, float, FloatArray, FloatArray]] = []
    findings: list[Finding] = []
    used = {0.0, 1.0}
    for between in shape.GetAuthoredInbetweens():
        attribute = between.GetAttr()
        name = attribute.GetDisplayName() or attribute.GetName().removeprefix("inbetweens:")
        weight = between.GetWeight()
        moved = vectors_of(between.GetOffsets())
        turned = vectors_of(between.GetNormalOffsets())
        if not isinstance(weight, float) or not np.isfinite(weight) or weight in used:
            why = f"its weight is {weight}; expected a number other than 0, 1 and its siblings'"
        elif len(moved) not in (0, size) or len(turned) not in (0, size):
            why = f"it has {len(moved)} offsets and {len(turned)} normal offsets; expected {size}"
        else:
            used.add(weight)
            found.append((name, weight, moved, turned))
            continue
        message = "inbetween {inbetween!r} is left out: {why}"
        where = str(shape.GetPath())
        findings.append(finding("INBETWEEN_DROPPED", where, message, name, Prose(why)))
    return sorted(found, key=lambda between: between[1]), findings


def _sorted(
    indices: IntArray, table: _Columns, where: str
) -> tuple[IntArray, _Columns, list[Finding]]:
    steps = np.diff(indices)
    if (steps > 0).all():
        return indices, table, []
    findings: list[Finding] = []
    if (steps < 0).any():
        findings.append(finding("POINT_INDICES_UNSORTED", where))
        order = np.argsort(indices, kind="stable")
        indices, table = indices[order], table[order]
    unique, first = np.unique(indices, return_index=True)
    if len(unique) < len(indices):
        findings.append(finding("POINT_INDICES_REPEATED", where))
        table = np.add.reduceat(table, first, axis=0)
    return unique, table, findings


def _in_rig_space(
    shape: BlendShape, vectors: FloatArray, normals: FloatArray, lengths: FloatArray
) -> BlendShape:
    """Return the shape in rig space: offsets are vectors, they do not move with an origin."""

    def bent(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values @ normals / lengths[shape.indices, None]

    return BlendShape(
        shape.name,
        shape.indices,
        shape.offsets @ vectors,
        bent(shape.normal_offsets),
        tuple(
            Inbetween(b.name, b.weight, b.offsets @ vectors, bent(b.normal_offsets))
            for b in shape.inbetweens
        ),
        shape.label,
        shape.combination,
    )
