"""Values by splines, which the lowest supported version of USD reads and does not evaluate."""

from pxr import Usd

from usdface.findings import Finding, finding
from usdface.io.usd.stage import stage_name

__all__ = ["report_splines"]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_EVALUATED = Usd.GetVersion() >= (0, 25, 5)
_OURS = "usdface:"  # which take no splines in any version, and are reported where they are read


def report_splines(stage: Usd.Stage) -> list[Finding]:
    """Return SPLINES_UNREAD for attributes whose values this version of USD does not give."""
    if _EVALUATED:
        return []
    names = [
        str(each.GetPath())
        for prim in stage.Traverse(_ALL)
        for each in prim.GetAuthoredAttributes()
        if each.HasSpline()
        and not each.GetNumTimeSamples()
        and not each.GetName().startswith(_OURS)
    ]
    if not names:
        return []
    where = stage_name(stage)
    message = (
        "{attributes} have splines, which USD evaluates from 25.05 on; here their defaults count"
    )
    return [finding("SPLINES_UNREAD", where, message, names)]
