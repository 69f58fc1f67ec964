"""Prims that move as a whole, as joints: glTF and UsdSkel then move them in the same way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.io.prim_names import prim_names
from usdface.io.transforms import along
from usdface.io.usd.stage import metrics_of, to_si
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["Mover", "carrier", "merged", "movers_of", "moving_codes", "with_movers"]

_SAME = 1e-9  # of a matrix


@dataclass(frozen=True, eq=False, slots=True)
class Mover:
    """How some prims move, relative to where they are when the stage starts.

    Attributes
    ----------
    name : str
        Of the lowest prim whose own transform moves.
    joint : str
        Path of the joint that it becomes, at the root of the skeleton.
    paths : tuple of str
        Meshes, or the skeleton, that move so.
    codes : (F,) float64
        Time codes of its keys.
    matrices : (F, 4, 4) float64
        In the rig's space, for row vectors, metres.
    """

    name: str
    joint: str
    paths: tuple[str, ...]
    codes: FloatArray
    matrices: FloatArray


def moving_codes(prim: Usd.Prim) -> dict[Sdf.Path, list[float]]:
    """Return the time codes at which the transforms of a prim, or of those above, have keys."""
    found = {}
    while prim and not prim.IsPseudoRoot():
        xform = UsdGeom.Xformable(prim)
        if xform and xform.TransformMightBeTimeVarying():
            found[prim.GetPath()] = list(xform.GetTimeSamples())
        prim = prim.GetParent()
    return found


def movers_of(stage: Usd.Stage, rig: Rig) -> tuple[Mover, ...]:
    """Return how the meshes without a skin, and the skeleton, of a rig move as a whole.

    A mesh with a skin goes with its skeleton. What moves alike is one mover.
    """
    prims = [stage.GetPrimAtPath(m.path) for m in rig.meshes if m.skin is None]
    prims += [skeleton for skeleton in map(_skeleton_of, _skinned(stage, rig)) if skeleton][:1]
    movers: list[Mover] = []
    for prim in prims:
        keys = moving_codes(prim)
        if not keys:
            continue
        codes = np.unique(np.concatenate([np.array(k) for k in keys.values()]))
        matrices = _relative(prim, codes)
        path = str(prim.GetPath())
        same = [m for m in movers if _alike(m, codes, matrices)]
        if same:
            place = movers.index(same[0])
            movers[place] = replace(same[0], paths=(*same[0].paths, path))
        else:
            movers.append(Mover(next(iter(keys)).name, "", (path,), codes, matrices))
    taken = rig.skeleton.joints if rig.skeleton else ()
    names = prim_names((mover.name for mover in movers), (j for j in taken if "/" not in j))
    return tuple(replace(m, joint=name) for m, name in zip(movers, names, strict=True))


def _skinned(stage: Usd.Stage, rig: Rig) -> list[Usd.Prim]:
    return [stage.GetPrimAtPath(mesh.path) for mesh in rig.meshes if mesh.skin is not None]


def _skeleton_of(mesh: Usd.Prim) -> Usd.Prim:
    return UsdSkel.BindingAPI(mesh).GetInheritedSkeleton().GetPrim()


def _alike(mover: Mover, codes: FloatArray, matrices: FloatArray) -> bool:
    return np.array_equal(mover.codes, codes) and np.allclose(
        mover.matrices, matrices, rtol=0, atol=_SAME
    )


def _relative(prim: Usd.Prim, codes: FloatArray) -> FloatArray:
    si = to_si(metrics_of(prim.GetStage()))

    def world(code: Usd.TimeCode) -> FloatArray:
        xform = UsdGeom.XformCache(code).GetLocalToWorldTransform(prim)
        return np.array(xform, np.float64) @ si

    start = np.linalg.inv(world(Usd.TimeCode.EarliestTime()))
    worlds = np.array([world(Usd.TimeCode(code)) for code in codes.tolist()])
    return np.asarray(start @ worlds, np.float64)


def carrier(rig: Rig, movers: Sequence[Mover]) -> str:
    """Return what joint paths of the skeleton begin with when a mover carries it, else ""."""
    meshes = {mesh.path for mesh in rig.meshes}
    return next((f"{m.joint}/" for m in movers if not meshes.issuperset(m.paths)), "")


def with_movers(rig: Rig, movers: Sequence[Mover]) -> Rig:
    """Return the rig with a joint for each mover, which stands at the origin."""
    if not movers:
        return rig
    old = rig.skeleton or Skeleton((), (), np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))
    prefix, still = carrier(rig, movers), np.tile(np.eye(4), (len(movers), 1, 1))
    skeleton = Skeleton(
        (*(m.joint for m in movers), *(prefix + joint for joint in old.joints)),
        (*(m.name for m in movers), *old.names),
        np.concatenate([still, old.bind]),
        np.concatenate([still, old.rest]),
    )
    place = {path: k for k, mover in enumerate(movers) for path in mover.paths}
    meshes = tuple(_with_skin(mesh, place.get(mesh.path), len(movers)) for mesh in rig.meshes)
    return replace(rig, meshes=meshes, skeleton=skeleton)


def _with_skin(mesh: Mesh, mover: int | None, shift: int) -> Mesh:
    if mesh.skin is not None:
        return replace(mesh, skin=Skin(mesh.skin.joints + shift, mesh.skin.weights))
    if mover is None:
        return mesh
    count = len(mesh.points)
    return replace(mesh, skin=Skin(np.full((count, 1), mover), np.ones((count, 1))))


def merged(takes: Sequence[JointsTake]) -> JointsTake | None:
    """Return takes of different joints as one, with the keys of all."""
    if len(takes) < 2:
        return takes[0] if takes else None
    times = np.unique(np.concatenate([take.times for take in takes]))
    parts = [_at(take, times) for take in takes]
    moves, turns, sizes = (np.concatenate(values, 1) for values in zip(*parts, strict=True))
    joints = tuple(joint for take in takes for joint in take.joints)
    return JointsTake(joints, times, moves, turns, sizes, max(take.rate for take in takes))


def _at(take: JointsTake, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    place = (np.searchsorted(take.times, times, side="right") - 1).clip(0)
    follow = (place + 1).clip(max=len(take.times) - 1)
    span = take.times[follow] - take.times[place]
    part = ((times - take.times[place]) / np.where(span > 0, span, 1.0)).clip(0, 1)
    part = np.where(span > 0, part, 0.0)

    def straight(values: FloatArray) -> FloatArray:
        change = part[:, None, None] * (values[follow] - values[place])
        return np.asarray(values[place] + change, np.float64)

    turns = [along(take.rotations[:, k], place, part) for k in range(len(take.joints))]
    return straight(take.translations), np.stack(turns, 1), straight(take.scales)
