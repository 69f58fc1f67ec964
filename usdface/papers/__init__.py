"""The published tables of the two papers, computed again: `usdface bench papers`.

Figures from: Troy, Pranowo, Gunanto, "2D to 3D Space Transformation for Facial Animation Based
on Marker Data", InAES 2016, Table I (``rbf_table1_angry.csv``; the source x of point 1 is
printed as 3506, by a misprint); Zikky, Hariadi, Muhtadin, "Semi Automatic Retargeting for
Facial Expressions of 3D Characters with Fuzzy Logic Based on Blendshape Interpolation",
EMITTER 1(1), 2013 (``fuzzy_published_cases.csv``; empty = illegible).
"""

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, frozen
from usdface.retarget.rbf import fit_paper_map
from usdface.rule_design.paper_system import published_table

__all__ = ["PaperTable", "fuzzy_table", "rbf_table", "tables"]

RBF_WITHIN = 0.01
FUZZY_RMS_WITHIN = 0.009
FUZZY_WITHIN = 0.041


@dataclass(frozen=True, eq=False, slots=True)
class PaperTable:
    """A published table beside what our code computes.

    Attributes
    ----------
    title : str
    rows, columns : tuple of str, length N and K
    published : (N, K) float64
        NaN where the print is illegible.
    computed : (N, K) float64
    promise : str
        What this project promises of the differences.
    within : bool
        Whether it is kept.
    """

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    published: FloatArray
    computed: FloatArray
    promise: str
    within: bool

    def __post_init__(self) -> None:
        object.__setattr__(self, "published", frozen(self.published))
        object.__setattr__(self, "computed", frozen(self.computed))

    @property
    def legible(self) -> int:
        """How many figures the print shows."""
        return int((~np.isnan(self.published)).sum())

    @property
    def rms(self) -> float:
        """Root mean square of the differences."""
        return float(np.sqrt(np.nanmean((self.computed - self.published) ** 2)))

    @property
    def largest(self) -> float:
        """Largest absolute difference."""
        return float(np.nanmax(np.abs(self.computed - self.published)))

    def as_dict(self) -> dict[str, Any]:
        """Return the table as plain values for JSON; None = illegible."""
        published = [[None if p != p else p for p in row] for row in self.published.tolist()]
        return {
            "title": self.title,
            "figures": self.legible,
            "rms": self.rms,
            "largest": self.largest,
            "promise": self.promise,
            "within": self.within,
            "rows": self.rows,
            "columns": self.columns,
            "published": published,
            "computed": self.computed.tolist(),
        }


def tables() -> list[PaperTable]:
    """Compute the tables of both papers."""
    return [rbf_table(), fuzzy_table()]


def _rbf_figures() -> dict[str, FloatArray]:
    text = files(__package__).joinpath("rbf_table1_angry.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def rbf_table() -> PaperTable:
    """Carry the angry frame of [RBF] Table I over by equations 5 to 10."""
    figures = _rbf_figures()

    def columns(prefix: str, axes: str) -> FloatArray:
        return np.stack([figures[f"{prefix}_{axis}"] for axis in axes], axis=1)

    space = fit_paper_map(columns("train_source", "xy"), columns("train_target", "xyz"))
    ours = space(columns("test_source", "xy"))
    published = columns("published", "xyz")
    largest = float(np.abs(ours - published).max())
    return PaperTable(
        "RBF space map: the angry frame, Table I",
        tuple(str(int(point)) for point in figures["point"]),
        ("x", "y", "z"),
        published,
        ours,
        f"every coordinate within {RBF_WITHIN}",
        largest <= RBF_WITHIN,
    )


def fuzzy_table() -> PaperTable:
    """Answer the fuzzy paper's six reference poses with its own system."""
    table = published_table()
    return PaperTable(
        "Fuzzy corrector: the six reference poses",
        table.poses,
        table.outputs,
        table.published,
        table.computed,
        f"RMS within {FUZZY_RMS_WITHIN}, every output within {FUZZY_WITHIN}",
        table.rms <= FUZZY_RMS_WITHIN and table.largest <= FUZZY_WITHIN,
    )
