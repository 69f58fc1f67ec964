"""The benchmark of the solve, from a checkout: `usdface bench solve`.

The other solvers and the takes of known weights are in `benchmarks/` beside the package, which an
installation does not have.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from usdface.errors import InputError

__all__ = ["solve_table"]

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = CHECKOUT.parent / "shared" / "data"


def solve_table(data: Path | None = None, quick: bool = False) -> dict[str, Any]:
    """Measure our solve and others on takes of known weights; plain values for JSON.

    Parameters
    ----------
    data : Path, optional
        Folder of the real data; `shared/data` beside the checkout, if left out. Where there is
        none, the example's head plays its own curves.
    quick : bool
        Short takes.

    Raises
    ------
    InputError
        If this is no checkout, or `data` has not what is needed.
    """
    if not (CHECKOUT / "benchmarks" / "solve").is_dir():
        raise InputError(
            f"bench solve needs a checkout of usdface: there is no benchmarks/solve beside "
            f"{CHECKOUT / 'usdface'}; clone the repository and run it there"
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.insert(0, str(CHECKOUT))
    if data is not None and not import_module("benchmarks.solve.faces").has_real_data(data):
        raise InputError(
            f"{data} has no range-of-motion curves and no ICT face; expected the folders "
            "livelinkface and ict_facekit, or leave --data out to play the example"
        )
    table: dict[str, Any] = import_module("benchmarks.solve.table").measured(data or DATA, quick)
    return table
