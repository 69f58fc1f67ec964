"""Takes that `usdface take` or another program wrote as USD."""

from pathlib import Path

from usdface.findings import Finding
from usdface.io.usd.stage import default_prim, open_stage
from usdface.io.usd.take import read_take_prim
from usdface.io.usd.unread_motion import report_unread_motion
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_usd_take"]


def read_usd_take(
    path: Path, options: TakeOptions
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read the take that is the default prim of a USD file; it names its own units and rate.

    Raises
    ------
    InputError
        If there is no default prim, or it is no take that can be used.
    """
    stage = open_stage(path)  # a prim does not keep its stage open
    prim = default_prim(stage, path)
    take, _ = read_take_prim(prim)
    return take, report_unread_motion(prim)
