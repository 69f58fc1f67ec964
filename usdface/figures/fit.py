"""A fitted system as a picture: its memberships, and what it confuses (matplotlib)."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.figures.picture import save_figure
from usdface.figures.terms import COLOURS, draw_value, name_terms
from usdface.fuzzy.fit.validation import Validation
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.system import FuzzySystem, Variable

__all__ = ["write_fit_figure"]

_COLUMNS = 4
_SAMPLES = 400
_MARGIN = 0.15


def write_fit_figure(system: FuzzySystem, validation: Validation | None, path: Path) -> None:
    """Draw the terms of every input and, where there was a test, the confusion matrix.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the file name is no picture's.
    OutputError
        If the file cannot be written.
    """

    def draw(figure: Any) -> None:
        tested = validation is not None and validation.tested > 0
        rows = max(1, -(-len(system.inputs) // _COLUMNS))
        figure.set_size_inches(12, 1.9 * rows + (5.5 if tested else 0.5))
        parts = figure.subfigures(2, 1, height_ratios=[1.9 * rows, 5.0]) if tested else [figure]
        axes = parts[0].subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
        for place, variable in zip(axes, system.inputs, strict=False):
            _draw_terms(place, variable)
        unit = "mm" if system.face_unit == "none" else "face units"
        title = f"how far each input's value, in {unit} from neutral, belongs to its terms"
        parts[0].suptitle(title, fontsize=10)
        for place in axes[len(system.inputs) :]:
            place.set_axis_off()
        if validation is not None and tested:
            _draw_confusion(parts[1].subplots(), validation)

    save_figure(draw, path)


def _draw_terms(axes: Any, variable: Variable) -> None:
    marks = np.array([0.0, *(p for t in variable.terms for p in places(t.kind, t.parameters))])
    room = _MARGIN * max(float(np.ptp(marks)), 1e-6)
    x = np.linspace(marks.min() - room, marks.max() + room, _SAMPLES)
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
    labels = [*validation.names, "none"]
    shown = validation.counts.sum(axis=1, keepdims=True)
    share = validation.counts / np.maximum(shown, 1)
    axes.imshow(share, vmin=0, vmax=1, cmap="Blues", aspect="auto")
    for (row, column), count in np.ndenumerate(validation.counts):
        if count:
            color = "white" if share[row, column] > 0.5 else "black"
            axes.text(column, row, str(count), ha="center", va="center", color=color, fontsize=8)
    axes.set_xticks(range(len(labels)), labels, fontsize=8, rotation=20, ha="right")
    axes.set_yticks(range(len(labels)), labels, fontsize=8)
    title = f"held out by {validation.holding}: {validation.right} of {validation.tested} right"
    axes.set(xlabel="heard", ylabel="shown", title=title)
