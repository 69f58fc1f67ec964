"""The meshes of the whole character of a shot, also of those beside the SkelRoot of its face."""

from pxr import Sdf, Usd

from usdface.io.usd.shot import ShotPrims
from usdface.io.usd.shown_meshes import placed_meshes, shown_meshes

__all__ = ["character_meshes"]


def character_meshes(stage: Usd.Stage, prims: ShotPrims) -> list[Usd.Prim]:
    """Return the meshes of a character that a render shows.

    The character is the highest prim above its SkelRoot that does not hold the setup, too.
    """
    setup = Sdf.Path(prims.retarget)
    above = Sdf.Path(prims.skel_root).GetPrefixes() if prims.skel_root else []
    own = [path for path in above if not setup.HasPrefix(path)] or above[-1:]
    if not own:
        return []
    meshes, _ = shown_meshes(placed_meshes(stage.GetPrimAtPath(own[0])))
    return meshes
