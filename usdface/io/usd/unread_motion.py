"""Motion of a SkelAnimation that a take of weights has no place for."""

from pxr import Usd, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes

__all__ = ["report_unread_motion"]


def report_unread_motion(prim: Usd.Prim) -> list[Finding]:
    """Return CHANNEL_IGNORED for joints that a SkelAnimation moves; nothing for a marker take."""
    animation = UsdSkel.Animation(prim)
    if not animation:
        return []
    moved = (
        animation.GetTranslationsAttr(),
        animation.GetRotationsAttr(),
        animation.GetScalesAttr(),
    )
    joints = list(map(str, animation.GetJointsAttr().Get() or ()))
    if not joints or not any(map(changes, moved)):
        return []
    message = "motion of joints is not read: {channels}"
    return [finding("CHANNEL_IGNORED", str(prim.GetPath()), message, joints)]
