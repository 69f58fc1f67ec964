"""A take from a recording or from USD."""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.files import read_take
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.usd.stage import default_prim, open_stage
from usdface.io.usd.take import read_take_prim
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_any_take"]

_USD = frozenset({".usda", ".usdc", ".usd"})


def read_any_take(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read a take of any kind that `usdface take` reads or writes.

    Raises
    ------
    InputError
        If it cannot be used, or options are given for a take in USD, which has its own unit,
        axes and clock.
    """
    if path.suffix.lower() not in _USD:
        return read_take(path, options)
    if options != DEFAULTS:
        raise InputError(
            f"{path} is USD, which carries its own unit, up axis and rate; leave the options out",
            "SETTING_WRONG",
        )
    stage = open_stage(path)
    take, _ = read_take_prim(default_prim(stage, path))
    return take, []
