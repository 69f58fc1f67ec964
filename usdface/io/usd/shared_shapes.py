"""One weight for each name of a blend shape, in a stage of several characters.

On a stage every skeleton has weights of its own; a rig has one weight for each name. Where equal
names of two skeletons move differently in any clip, those of the later one are renamed
``character:name``, as glTF's are ``mesh:name`` (`usdface.io.gltf.read_weights`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.usd.clip_variants import bound_animations, clip_stages
from usdface.io.usd.skel_bindings import skeleton_of_meshes
from usdface.rigs import Mesh, Rig

__all__ = ["ShapeNames", "separate_shapes"]

_SAME = 1e-6  # of a weight: 8 roundings of float32

ShapeNames = Mapping[Sdf.Path, Mapping[str, str]]  # by skeleton: names in the rig by own names


@dataclass(frozen=True, eq=False, slots=True)
class _Curve:
    codes: FloatArray
    values: FloatArray

    def equals(self, other: "_Curve") -> bool:
        codes = np.union1d(self.codes, other.codes)
        one, two = (np.interp(codes, c.codes, c.values) for c in (self, other))
        return bool(np.allclose(one, two, rtol=0, atol=_SAME))


_STILL = _Curve(np.zeros(1), np.zeros(1))


def separate_shapes(stage: Usd.Stage, rig: Rig) -> tuple[Rig, ShapeNames, list[Finding]]:
    """Rename shapes of a rig whose name is that of another character's, with other weights."""
    skeletons = skeleton_of_meshes(stage)
    shaped = [mesh for mesh in rig.meshes if mesh.shapes]
    holders = {skeletons.get(mesh.path) for mesh in shaped}
    if len(holders) < 2:
        return rig, {}, []
    clips = [_curves(variation) for variation in clip_stages(stage)]
    first: dict[str, Sdf.Path | None] = {}
    names: dict[Sdf.Path | None, dict[str, str]] = {holder: {} for holder in holders}
    taken = set(rig.shape_names)
    meshes, found = [], []
    for mesh in rig.meshes:
        holder = skeletons.get(mesh.path)
        for name in mesh.shape_names:
            other = first.setdefault(name, holder)
            if (
                name not in names[holder]
                and other != holder
                and _differ(clips, holder, other, name)
            ):
                names[holder][name] = _unused(_character(stage, mesh, holder), name, taken)
                message = "moves unlike the shape of that name on {other}; now {name!r}"
                there, new = str(other or "a mesh without"), names[holder][name]
                found.append(finding("NAME_CHANGED", f"{mesh.path}/{name}", message, there, new))
        meshes.append(_renamed(mesh, names.get(holder, {})))
    kept = {holder: own for holder, own in names.items() if holder is not None}
    return replace(rig, meshes=tuple(meshes)), kept, found


def _curves(stage: Usd.Stage) -> dict[Sdf.Path, dict[str, _Curve]]:
    """Return the curves of all weights that move a skeleton, by its path and their names."""
    found = {}
    for bound in bound_animations(stage):
        query = bound.animation
        names = [str(name) for name in query.GetBlendShapeOrder()]
        attribute = UsdSkel.Animation(query.GetPrim()).GetBlendShapeWeightsAttr()
        codes: Sequence[float] = query.GetBlendShapeWeightTimeSamples()
        rows = [attribute.Get(code) for code in codes] or [attribute.Get() or [0.0] * len(names)]
        if all(row is not None and len(row) == len(names) for row in rows):  # else refused later
            values = np.array(rows, np.float64).reshape(len(rows), len(names))
            clock = np.array(codes or [0.0])
            curves = (_Curve(clock, column) for column in values.T)
            found[bound.prim.GetPath()] = dict(zip(names, curves, strict=True))
    return found


def _differ(
    clips: Sequence[Mapping[Sdf.Path, Mapping[str, _Curve]]],
    one: Sdf.Path | None,
    other: Sdf.Path | None,
    name: str,
) -> bool:
    def of(clip: Mapping[Sdf.Path, Mapping[str, _Curve]], path: Sdf.Path | None) -> _Curve:
        return clip.get(path, {}).get(name, _STILL) if path is not None else _STILL

    return not all(of(clip, one).equals(of(clip, other)) for clip in clips)


def _character(stage: Usd.Stage, mesh: Mesh, skeleton: Sdf.Path | None) -> str:
    root = UsdSkel.Root.Find(stage.GetPrimAtPath(skeleton)) if skeleton is not None else None
    return str(root.GetPrim().GetName()) if root else mesh.name


def _unused(character: str, name: str, taken: set[str]) -> str:
    number, made = 1, f"{character}:{name}"
    while made in taken:
        number += 1
        made = f"{character}:{name}_{number}"
    taken.add(made)
    return made


def _renamed(mesh: Mesh, names: Mapping[str, str]) -> Mesh:
    if not set(names) & set(mesh.shape_names):
        return mesh
    shapes = (
        replace(shape, name=names[shape.name], label=shape.label or shape.name)
        if shape.name in names
        else shape
        for shape in mesh.shapes
    )
    return replace(mesh, shapes=tuple(shapes))
