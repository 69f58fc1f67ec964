"""The meshes of the whole character of a shot, also of those beside the SkelRoot of its face."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.usd.metrics import to_si
from usdface.io.usd.rendered_meshes import placed_meshes, rendered_meshes
from usdface.io.usd.shot import StagedShot
from usdface.io.usd.skel_bindings import spaces_of_meshes
from usdface.io.usd.unconverted_scene import report_unconverted_scene

__all__ = ["character_meshes", "near_face", "points_of", "report_left_out"]

_START = Usd.TimeCode.EarliestTime()


def character_meshes(staged: StagedShot) -> list[Usd.Prim]:
    """Return the meshes of a character that a render shows.

    The character is the highest prim above its SkelRoot that does not hold the setup, too.
    """
    prims = staged.prims
    setup = Sdf.Path(prims.retarget)
    above = Sdf.Path(prims.skel_root).GetPrefixes() if prims.skel_root else []
    own = [path for path in above if not setup.HasPrefix(path)] or above[-1:]
    if not own:
        return []
    meshes, _ = rendered_meshes(placed_meshes(staged.stage.GetPrimAtPath(own[0])))
    return meshes


def points_of(prims: Sequence[Usd.Prim], staged: StagedShot) -> dict[str, FloatArray]:
    """Return the points (V, 3) [m] of meshes in the space of the shot's rig, by their paths."""
    if not prims:
        return {}
    spaces = spaces_of_meshes(prims[0].GetStage())
    turn = np.linalg.inv(to_si(staged.metrics)) @ staged.to_rig
    places = {}
    for prim in prims:
        path, points = str(prim.GetPath()), UsdGeom.Mesh(prim).GetPointsAttr().Get(_START)
        if points and path in spaces:
            space = spaces[path] @ turn
            places[path] = np.array(points, np.float64) @ space[:3, :3] + space[3, :3]
    return places


def near_face(prims: Sequence[Usd.Prim], staged: StagedShot) -> list[str]:
    """Return the paths of the meshes that reach into the box of the face.

    Others may be of another person on the stage, or of the set.
    """
    face = staged.shot.rig.mesh(staged.shot.setup.binding.mesh).points
    low, high = face.min(axis=0), face.max(axis=0)
    return [
        path
        for path, points in points_of(prims, staged).items()
        if (points.min(axis=0) <= high).all() and (points.max(axis=0) >= low).all()
    ]


def report_left_out(staged: StagedShot) -> list[Finding]:
    """Return findings on parts of a stage that a glTF of the shot lacks.

    Of meshes, on those near the face; else as `usdface export`, and on cameras, lights and
    assetInfo, which that writes.
    """
    rig, stage = staged.shot.rig, staged.stage
    return [
        *_left_out_meshes(staged),
        *_left_out_views(staged),
        *report_unconverted_scene(stage, rig.meshes, None),
    ]


def _left_out_views(staged: StagedShot) -> list[Finding]:
    prims = list(staged.stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    views = {
        "camera": [str(prim.GetPath()) for prim in prims if prim.IsA(UsdGeom.Camera)],
        "light": [str(prim.GetPath()) for prim in prims if prim.HasAPI(UsdLux.LightAPI)],
    }
    message = "left out; `usdface export` of the result writes it: {names}"
    return [
        finding("FEATURE_DROPPED", kind, message, names, feature=kind)
        for kind, names in views.items()
        if names
    ]


def _left_out_meshes(staged: StagedShot) -> list[Finding]:
    known = {mesh.path for mesh in staged.shot.rig.meshes}
    meshes = character_meshes(staged)
    names = near_face([prim for prim in meshes if str(prim.GetPath()) not in known], staged)
    if not names:
        return []
    message = (
        "{names} are left out: they are not below the SkelRoot of the face; `usdface export` of "
        "the result writes all"
    )
    where = staged.prims.skel_root
    return [finding("FEATURE_DROPPED", where, message, names, feature="mesh")]
