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

from usdface.arrays import FloatArray, freeze
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.system import FuzzySystem
from usdface.numerics.rms import rms
from usdface.retarget.rbf import fit_paper_map
from usdface.rule_design.paper_system import EMOTIONS, paper_system, published_cases

__all__ = ["PaperTable", "fuzzy_table", "rbf_table", "tables"]

# A unit of the second decimal, the last in print: outputs and inputs are rounded to half of it.
RBF_WITHIN = 0.01
# As `benchmarks/paper_fit.py` finds them (0.0082 and 0.039), and 5 to 10 % for other arithmetic.
FUZZY_RMS_WITHIN = 0.009
FUZZY_WITHIN = 0.041


@dataclass(frozen=True, eq=False, slots=True)
class PaperTable:
    """A published table, computed again.

    Attributes
    ----------
    title : str
    rows, columns : tuple of str, length N and K
    published : (N, K) float64
        NaN where the print is illegible.
    computed : (N, K) float64
    largest_within, rms_within : float
        Promised bounds of the largest and the RMS difference; infinite where nothing is promised.
    """

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    published: FloatArray
    computed: FloatArray
    largest_within: float
    rms_within: float = float("inf")

    def __post_init__(self) -> None:
        freeze(self, "published", "computed")

    @property
    def legible(self) -> int:
        """Number of figures that the print shows."""
        return int((~np.isnan(self.published)).sum())

    @property
    def rms(self) -> float:
        """Root mean square of the differences."""
        return rms(self.computed - self.published)

    @property
    def largest(self) -> float:
        """Largest absolute difference."""
        return float(np.nanmax(np.abs(self.computed - self.published)))

    @property
    def within(self) -> bool:
        """Whether the promise is kept."""
        return self.largest <= self.largest_within and self.rms <= self.rms_within

    @property
    def promise(self) -> str:
        """The promised bounds, in words."""
        if np.isinf(self.rms_within):
            return f"every figure within {self.largest_within}"
        return f"RMS within {self.rms_within}, every figure within {self.largest_within}"

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


def rbf_table() -> PaperTable:
    """Map the angry frame of Troy et al., Table I, by their equations 5 to 10."""
    text = files(__package__).joinpath("rbf_table1_angry.csv").read_text(encoding="utf-8")
    printed = list(csv.DictReader(text.splitlines()))

    def columns(prefix: str, axes: str) -> FloatArray:
        return np.array([[float(row[f"{prefix}_{axis}"]) for axis in axes] for row in printed])

    space = fit_paper_map(columns("train_source", "xy"), columns("train_target", "xyz"))
    return PaperTable(
        title="RBF space map: the angry frame, Table I",
        rows=tuple(row["point"] for row in printed),
        columns=("x", "y", "z"),
        published=columns("published", "xyz"),
        computed=space(columns("test_source", "xy")),
        largest_within=RBF_WITHIN,
    )


def fuzzy_table(system: FuzzySystem | None = None) -> PaperTable:
    """Evaluate the six reference poses of Zikky et al. by their system, or one of its inputs."""
    cases = published_cases()
    return PaperTable(
        title="Fuzzy corrector: the six reference poses",
        rows=cases.poses,
        columns=EMOTIONS,
        published=cases.outputs,
        computed=evaluate(system or paper_system().fuzzy, cases.inputs).outputs,
        largest_within=FUZZY_WITHIN,
        rms_within=FUZZY_RMS_WITHIN,
    )
