"""Checks of the blend shapes of a USD stage, beyond those of UsdValidation.

One function for one rule. Severities (see `usdface.findings.codes.CODES`): an *error* makes
UsdSkel or a common reader move nothing, or something else than authored. A *warning* plays,
but differently in different programs. An *info* is legal and often meant: weights beyond 0
and 1 (over-driven shapes), unsorted point indices (some importers need them sorted).
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.stray_points import stray_point
from usdface.io.usd.blend_shapes import blend_shape_at
from usdface.io.usd.check_bindings import check_bindings
from usdface.io.usd.check_shapes import check_shapes, finite_points, names_and_targets, shapes_of
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.stage import open_stage

__all__ = ["check_stage", "check_usd"]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_START = Usd.TimeCode.EarliestTime()
_ROUNDING = 1e-5  # rounding of exporters, beyond weights of 0 and 1
Findings = Iterator[Finding]


def check_usd(path: Path) -> list[Finding]:
    """Check the blend shapes of a USD file.

    Raises
    ------
    InputError
        If the file cannot be read at all.
    """
    return check_stage(open_stage(path))


def check_stage(stage: Usd.Stage) -> list[Finding]:
    """Check the blend shapes of an open stage."""
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        prims = Usd.PrimRange(stage.GetPseudoRoot(), _ALL)
        return [*(f for prim in prims for f in _check_prim(prim)), *check_bindings(stage)]


def _check_prim(prim: Usd.Prim) -> Findings:
    yield from _bindings_exist(prim)
    if prim.IsA(UsdGeom.Mesh):
        for mesh_rule in _MESH_RULES:
            yield from mesh_rule(prim)
        yield from check_shapes(prim)
    elif prim.IsA(UsdSkel.Animation):
        yield from _weights_fit(UsdSkel.Animation(prim))


def _bindings_exist(prim: Usd.Prim) -> Findings:
    binding = UsdSkel.BindingAPI(prim)
    for relation, kind in (
        (binding.GetSkeletonRel(), UsdSkel.Skeleton),
        (binding.GetAnimationSourceRel(), UsdSkel.Animation),
    ):
        for target in relation.GetForwardedTargets() if relation else ():
            named = prim.GetStage().GetPrimAtPath(target)
            if not kind(named) or not named.IsActive():
                message = "{relationship} of {prim} names no active {expected}"
                yield finding(
                    "BINDING_TARGET_MISSING",
                    str(target),
                    message,
                    relation.GetName(),
                    prim.GetPath(),
                    kind.__name__,
                )


def _names_match_targets(prim: Usd.Prim) -> Findings:
    names, targets = names_and_targets(prim)
    if len(names) != len(targets):
        message = "{name_count} skel:blendShapes for {shape_count} skel:blendShapeTargets"
        yield finding(
            "SHAPE_NAMES_MISMATCH", str(prim.GetPath()), message, len(names), len(targets)
        )


def _names_are_unique(prim: Usd.Prim) -> Findings:
    names, _ = names_and_targets(prim)
    for name in sorted({n for n in names if names.count(n) > 1}):
        message = "the name {shape!r} occurs {name_count} times; UsdSkel moves the first"
        yield finding("SHAPE_NAME_REPEATED", str(prim.GetPath()), message, name, names.count(name))


def _targets_exist(prim: Usd.Prim) -> Findings:
    for target in names_and_targets(prim)[1]:
        if not blend_shape_at(prim.GetStage(), target):
            message = (
                "{mesh} names no active BlendShape; UsdSkel moves another by its weight, or none"
            )
            yield finding("SHAPE_TARGET_MISSING", str(target), message, prim.GetPath())


def _faces_fit_points(prim: Usd.Prim) -> Findings:
    mesh = UsdGeom.Mesh(prim)
    where, codes = str(prim.GetPath()), mesh.GetPointsAttr().GetTimeSamples()
    counts = {len(mesh.GetPointsAttr().Get(code) or ()) for code in codes or [_START]}
    if len(counts) > 1:
        message = "points change in number over time, {least_count} to {most_count}"
        yield finding("TOPOLOGY_DIFFERS", where, message, min(counts), max(counts))
    sizes = np.asarray(mesh.GetFaceVertexCountsAttr().Get(_START) or [], np.int64)
    corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(_START) or [], np.int64)
    if sizes.sum() != len(corners):
        message = "{index_count} faceVertexIndices for faces with {corner_count} corners"
        yield finding("TOPOLOGY_DIFFERS", where, message, len(corners), sizes.sum())
    outside = corners[(corners < 0) | (corners >= min(counts))]
    if len(outside):
        message = "a face names point {point} of a mesh with {point_count} points"
        yield finding("TOPOLOGY_DIFFERS", where, message, outside[0], min(counts))


def _points_are_near(prim: Usd.Prim) -> Findings:
    stray = stray_point(finite_points(prim))
    if stray:
        yield finding("POINT_STRAY", str(prim.GetPath()), *stray)


def _normals_are_there(prim: Usd.Prim) -> Findings:
    mesh = UsdGeom.Mesh(prim)
    if mesh.GetSubdivisionSchemeAttr().Get() != UsdGeom.Tokens.none:
        return  # subdivision makes them
    primvar = UsdGeom.PrimvarsAPI(prim).HasPrimvar("normals")
    shapes = shapes_of(prim)
    if shapes and not (primvar or mesh.GetNormalsAttr().HasAuthoredValue()):
        message = "a polygonal mesh with blend shapes has no normals"
        yield finding("NORMALS_MISSING", str(prim.GetPath()), message)
        return
    without = [
        s.GetPrim().GetName() for s in shapes if not len(s.GetNormalOffsetsAttr().Get() or ())
    ]
    if without:
        message = "no normalOffsets: {shapes}"
        yield finding("NORMALS_MISSING", str(prim.GetPath()), message, without)


_MESH_RULES: tuple[Callable[[Usd.Prim], Findings], ...] = (
    _names_match_targets,
    _names_are_unique,
    _targets_exist,
    _faces_fit_points,
    _points_are_near,
    _normals_are_there,
)


def _weights_fit(animation: UsdSkel.Animation) -> Findings:
    where = str(animation.GetPath())
    names = [str(name) for name in animation.GetBlendShapesAttr().Get() or ()]
    for name in sorted({n for n in names if names.count(n) > 1}):
        message = "the name {shape!r} occurs {name_count} times; UsdSkel takes the last"
        yield finding("SHAPE_NAME_REPEATED", where, message, name, names.count(name))
    attribute = animation.GetBlendShapeWeightsAttr()
    codes: list[float | None] = list(attribute.GetTimeSamples()) or [None]
    values = [attribute.Get() if code is None else attribute.Get(code) for code in codes]
    rows = {
        code: np.asarray(row, np.float64)
        for code, row in zip(codes, values, strict=True)
        if row is not None
    }
    wrong = [code for code, row in rows.items() if len(row) != len(names)]
    if wrong:
        message = "{weight_count} weights for {shape_count} blendShapes{when}"
        counts = len(rows[wrong[0]]), len(names)
        yield finding("WEIGHTS_LENGTH_WRONG", where, message, *counts, _when(wrong), **_at(wrong))
    broken = [code for code, row in rows.items() if not np.isfinite(row).all()]
    if broken:
        message = "a weight is NaN or infinite{when}"
        yield finding("VALUES_WRONG", where, message, _when(broken), **_at(broken))
    beyond = [
        code for code, row in rows.items() if ((row < -_ROUNDING) | (row > 1 + _ROUNDING)).any()
    ]
    if beyond:
        message = "a weight is outside 0 to 1{when}"
        yield finding("WEIGHTS_OUT_OF_RANGE", where, message, _when(beyond), **_at(beyond))


def _when(codes: list[float | None]) -> Prose:
    first = "" if codes[0] is None else f" at time code {codes[0]:g}"
    return Prose(first + (f" and at {len(codes) - 1} more" if len(codes) > 1 else ""))


def _at(codes: list[float | None]) -> dict[str, object]:
    """Return the time codes as a value of a finding; None = the default value."""
    return {"time_codes": codes}
