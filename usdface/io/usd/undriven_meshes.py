"""Meshes near a face that have its blend shapes, which the shot's SkelAnimation does not move."""

from pxr import Sdf, Usd

from usdface.findings import Finding, finding
from usdface.io.usd.character_meshes import character_meshes, near_face
from usdface.io.usd.shot import ShotPrims, StagedShot
from usdface.io.usd.skel_bindings import active_skeleton, active_source

__all__ = ["report_undriven"]


def report_undriven(staged: StagedShot) -> list[Finding]:
    """Return MESHES_UNDRIVEN for meshes whose blend shapes of the face's names stay as they are.

    A result is authored on one SkelAnimation: that of the face's skeleton.
    """
    prims = staged.prims
    face = staged.shot.rig.mesh(staged.shot.setup.binding.mesh)
    names = {*face.shape_names, *prims.tokens}
    alike = [
        prim
        for prim in character_meshes(staged)
        if names & {*map(str, prim.GetAttribute("skel:blendShapes").Get() or ())}
        and not _is_driven(prim, prims)
    ]
    near = near_face(alike, staged)
    if not near:
        return []
    message = (
        "{meshes} have blend shapes of the same names, but another SkelAnimation moves them, or "
        "none; let their skeletons have this one as skel:animationSource"
    )
    where = prims.animation or prims.skeleton
    return [finding("MESHES_UNDRIVEN", where, message, near)]


def _is_driven(mesh: Usd.Prim, prims: ShotPrims) -> bool:
    skeleton = active_skeleton(mesh)
    if skeleton is None:
        return False
    path = skeleton.GetPath()
    source = active_source(skeleton)
    if prims.animation or source:
        return source is not None and str(source.GetPath()) == prims.animation
    # The one that is made is bound to the face's skeleton, and to the SkelRoot for others below it.
    return bool(path == Sdf.Path(prims.skeleton) or path.HasPrefix(prims.skel_root))
