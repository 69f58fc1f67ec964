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

from usdface.fuzzy.paper import published_table
from usdface.retarget.rbf import fit_paper_map
from usdface.takes import FloatArray

__all__ = ["PaperTable", "fuzzy_table", "rbf_table", "tables"]

RBF_WITHIN = 0.01
FUZZY_RMS_WITHIN = 0.01


@dataclass(frozen=True, slots=True)
class PaperTable:
    """A published table beside what our code computes.

    Attributes
    ----------
    title, caption : str
    columns : tuple of str
    rows : tuple of tuple
        A cell is text, a number, or None where the paper has none.
    rms, largest : float
        Of the differences.
    within : bool
        Whether they are as small as this project promises.
    """

    title: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str | float | None, ...], ...]
    rms: float
    largest: float
    within: bool

    def as_dict(self) -> dict[str, Any]:
        """Return the table as plain values for JSON."""
        return {
            "title": self.title,
            "rms": self.rms,
            "largest": self.largest,
            "within": self.within,
            "rows": [dict(zip(self.columns, row, strict=True)) for row in self.rows],
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
    off = ours - published
    names = [f"{axis} {kind}" for axis in "xyz" for kind in ("published", "ours", "off")]
    rows = tuple(
        (
            int(figures["point"][i]),
            *(
                value
                for axis in range(3)
                for value in (
                    published[i, axis],
                    round(ours[i, axis], 4),
                    round(off[i, axis], 4),
                )
            ),
        )
        for i in range(len(ours))
    )
    rms, largest = float(np.sqrt((off**2).mean())), float(np.abs(off).max())
    return PaperTable(
        "RBF space map: angry frame, Table I",
        f"99 coordinates: RMS {rms:.4f}, largest {largest:.4f} (promised {RBF_WITHIN})",
        ("point", *names),
        rows,
        rms,
        largest,
        largest <= RBF_WITHIN,
    )


def fuzzy_table() -> PaperTable:
    """Answer the fuzzy paper's six reference poses with its own system."""
    table = published_table()
    names = [f"{output} {kind}" for output in table.outputs for kind in ("published", "ours")]
    rows = tuple(
        (
            pose,
            *(
                value
                for column in range(len(table.outputs))
                for value in (
                    None
                    if np.isnan(table.published[row, column])
                    else float(table.published[row, column]),
                    round(float(table.computed[row, column]), 3),
                )
            ),
        )
        for row, pose in enumerate(table.poses)
    )
    legible = int((~np.isnan(table.published)).sum())
    return PaperTable(
        "Fuzzy corrector: six reference poses",
        f"{legible} legible outputs: RMS {table.rms:.4f} (promised {FUZZY_RMS_WITHIN}), "
        f"largest {table.largest:.3f}",
        ("pose", *names),
        rows,
        table.rms,
        table.largest,
        table.rms <= FUZZY_RMS_WITHIN,
    )
