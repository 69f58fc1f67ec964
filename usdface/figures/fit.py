"""Figure of a fitted system: memberships and confusion matrix (matplotlib)."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.expression_system import ExpressionSystem
from usdface.figures.picture import save_figure
from usdface.figures.terms import COLOURS, draw_value, name_terms
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.variables import Variable
from usdface.rule_learning.cross_validation import Validation

__all__ = ["write_fit_figure"]

# Layout: panels in a row, samples of a curve, margin as a share of the range.
_COLUMNS = 4
_SAMPLES = 400
_MARGIN = 0.15
_FACE_UNIT = "face units (the RMS distance of the neutral markers from their centre)"
# Colours of right and wrong predictions.
_RIGHT, _WRONG = np.array([0.0, 0.45, 0.70]), np.array([0.84, 0.37, 0.0])


def write_fit_figure(system: ExpressionSystem, validation: Validation | None, path: Path) -> None:
    """Draw the terms of every input and, where there was a test, the confusion matrix.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """

    def draw(figure: Any) -> None:
        tested = validation is not None and validation.tested > 0
        rows = max(1, -(-len(system.fuzzy.inputs) // _COLUMNS))
        shown = int((validation.counts.sum(axis=1) > 0).sum()) if validation is not None else 0
        below = 1.2 + 0.45 * shown
        figure.set_size_inches(12, 1.9 * rows + 0.5 + (below if tested else 0.0))
        parts = figure.subfigures(2, 1, height_ratios=[1.9 * rows, below]) if tested else [figure]
        axes = parts[0].subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
        for place, variable in zip(axes, system.fuzzy.inputs, strict=False):
            _draw_terms(place, variable)
        unit = "mm" if system.face_unit == "none" else _FACE_UNIT
        title = f"membership of each input, from neutral in {unit}, in its terms"
        parts[0].suptitle(title, fontsize=10)
        for place in axes[len(system.fuzzy.inputs) :]:
            place.set_axis_off()
        if validation is not None and tested:
            _draw_confusion(parts[1].subplots(), validation)

    save_figure(draw, path)


def _draw_terms(axes: Any, variable: Variable) -> None:
    marks = np.array([0.0, *(p for t in variable.terms for p in places(t.kind, t.parameters))])
    margin = _MARGIN * max(float(np.ptp(marks)), 1e-6)
    x = np.linspace(marks.min() - margin, marks.max() + margin, _SAMPLES)
    for i, term in enumerate(variable.terms):
        colour = COLOURS[i % len(COLOURS)]
        axes.plot(x, membership(term.kind, term.parameters, x), label=term.name, color=colour)
    draw_value(axes, 0.0, "0.6")
    axes.set_title(variable.name, fontsize=8)
    axes.set_xlim(x[0], x[-1])
    axes.tick_params(labelsize=6)
    axes.locator_params(axis="x", nbins=5)
    name_terms(axes, 6)


def _draw_confusion(axes: Any, validation: Validation) -> None:
    """Draw the counts, a row for each emotion that was tested: right in blue, wrong in orange."""
    labels = [*validation.names, "none"]
    tested = np.flatnonzero(validation.counts.sum(axis=1))
    counts = validation.counts[tested]
    share = (counts / counts.sum(axis=1, keepdims=True))[..., None]
    right = (tested[:, None] == np.arange(len(labels)))[..., None]
    axes.imshow(1.0 - share * (1.0 - np.where(right, _RIGHT, _WRONG)), aspect="auto")
    for (row, column), count in np.ndenumerate(counts):
        if count:
            color = "white" if share[row, column, 0] > 0.5 else "black"
            axes.text(column, row, str(count), ha="center", va="center", color=color, fontsize=8)
    axes.set_xticks(range(len(labels)), labels, fontsize=8, rotation=20, ha="right")
    axes.set_yticks(range(len(tested)), [labels[i] for i in tested], fontsize=8)
    axes.set_xticks(np.arange(len(labels) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(tested) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="0.9", linewidth=0.8)
    axes.tick_params(which="minor", length=0)
    title = f"held out by {validation.holding}: {validation.right} of {validation.tested} correct"
    untested = len(labels) - len(tested)
    title += f" ({untested} of {len(labels)} emotions without a test)" if untested else ""
    axes.set(xlabel="predicted", ylabel="true", title=title)
