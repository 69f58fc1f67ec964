"""The corrector as a picture: emotions, rules, memberships, and weights before and after."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.explain import Explanation
from usdface.fuzzy.membership import membership
from usdface.fuzzy.rules import Rule
from usdface.picture import save_figure

__all__ = ["write_explanation_figure"]

_COLUMNS = 4
_LARGEST_FEATURES = 8
_LARGEST_WEIGHTS = 16
# How many parameters of a term are places, where not all are.
_PLACES = {"gaussian": 1, "gaussian_pair": 1, "sigmoid": 1, "bell": 1}
_HEIGHT = (-0.03, 1.05)
# Told apart by the colour-blind: M. Okabe, K. Ito, "Color Universal Design", 2008; two more.
_COLOURS = (
    "#E69F00",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
    "#009E73",
    "#56B4E9",
    "#000000",
    "#8C6D31",
    "#7F7F7F",
)


def write_explanation_figure(explained: Explanation, frame: int, path: Path) -> None:
    """Draw a take's emotions and rules, and one frame's memberships and weights.

    Raises
    ------
    InputError
        If matplotlib is not installed, the file name is no picture's, or there is no such frame.
    OutputError
        If the file cannot be written.
    """
    facts = explained.frame(frame)
    shown = _asked_most(explained, facts)
    rows = max(1, -(-len(shown) // _COLUMNS))
    heights = (2.2, 0.8 + 0.24 * max(2, len(explained.system.rules)), 2.1 * rows, 2.8)

    def draw(figure: Any) -> None:
        figure.set_size_inches(12, sum(heights) + 0.6)
        moment = f"frame {frame}, {explained.times[frame]:.3f} s"
        figure.suptitle(f"{moment} (lines, dots); grey: where the take goes")
        grid = figure.add_gridspec(4, 1, height_ratios=heights)
        _draw_emotions(figure.add_subplot(grid[0]), explained, frame)
        _draw_rules(figure, figure.add_subplot(grid[1]), explained, frame)
        places = grid[2].subgridspec(rows, _COLUMNS)
        for place, column in enumerate(shown):
            axes = figure.add_subplot(places[place // _COLUMNS, place % _COLUMNS])
            _draw_memberships(axes, explained, frame, column)
        _draw_weights(figure.add_subplot(grid[3]), facts)

    save_figure(draw, path)


def _colours(explained: Explanation) -> dict[str, str]:
    names = explained.system.emotions
    return {name: _COLOURS[i % len(_COLOURS)] for i, name in enumerate(names)}


def _draw_emotions(axes: Any, explained: Explanation, frame: int) -> None:
    for (name, colour), curve in zip(_colours(explained).items(), explained.outputs.T, strict=True):
        axes.plot(explained.times, curve, color=colour, label=name)
    axes.axvline(explained.times[frame], color="0.4", linewidth=0.8)
    axes.set(title="emotions", xlim=_span(explained), ylim=_HEIGHT)
    axes.tick_params(labelbottom=False)
    if explained.system.emotions:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _draw_rules(figure: Any, axes: Any, explained: Explanation, frame: int) -> None:
    low, high = _span(explained)
    rules = explained.system.rules
    drawn = axes.imshow(
        explained.firing.T if rules else np.zeros((1, 1)),
        aspect="auto",
        interpolation="nearest",
        vmin=0,
        vmax=1,
        cmap="magma",
        extent=(low, high, max(1, len(rules)), 0),
    )
    axes.axvline(explained.times[frame], color="0.8", linewidth=0.8)
    axes.set_yticks(np.arange(len(rules)) + 0.5, [_short(rule) for rule in rules], fontsize=7)
    axes.set(title="how far each rule fires", xlabel="time [s]")
    figure.colorbar(drawn, ax=axes, fraction=0.02, pad=0.01)


def _short(rule: Rule) -> str:
    """Return what a rule says and the first thing that it asks for."""
    says = ", ".join(output for output, _ in rule.consequents)
    first, *others = rule.propositions
    is_ = " ".join((*first.hedges, first.term))
    more = f" + {len(others)} more" if others else ""
    return f"{says}: {first.variable} {is_}{more}{'' if rule.enabled else ' (off)'}"


def _asked_most(explained: Explanation, facts: dict[str, Any]) -> list[int]:
    """Return the inputs to draw: those of the rules that fire most, then those that belong most."""
    order = [v.name for v in explained.system.inputs]
    fired = [c["variable"] for r in facts["rules"] if r["fires"] > 0 for c in r["conditions"]]
    belongs = [max(f["terms"].values(), default=0.0) for f in facts["features"]]
    rest = sorted(range(len(order)), key=lambda i: -belongs[i])
    columns = dict.fromkeys([*map(order.index, fired), *rest])
    return [i for i in columns if explained.system.inputs[i].terms][:_LARGEST_FEATURES]


def _draw_memberships(axes: Any, explained: Explanation, frame: int, column: int) -> None:
    """Draw the terms of an input over what the take does of it, in millimetres; now is a line."""
    variable, scale = explained.system.inputs[column], 1000.0 * explained.unit
    values = explained.inputs[:, column]
    seen = values[np.isfinite(values)]
    # A take that hardly moves still shows where its terms begin.
    marks = [p for t in variable.terms for p in t.parameters[: _PLACES.get(t.kind)]]
    marks = [p for p in marks if np.isfinite(p)]
    low, high = min([*seen, *marks, 0.0]), max([*seen, *marks, 0.0])
    pad = 0.05 * (high - low) or 1e-9
    x = np.linspace(low - pad, high + pad, 300)
    if seen.size:
        axes.axvspan(scale * seen.min(), scale * seen.max(), color="0.93", zorder=0)
    value = values[frame : frame + 1]
    for i, term in enumerate(variable.terms):
        colour = _COLOURS[i % len(_COLOURS)]
        y = membership(term.kind, term.parameters, x)
        axes.plot(scale * x, y, color=colour, label=term.name)
        if np.isfinite(value[0]):
            now = membership(term.kind, term.parameters, value)
            axes.plot(scale * value, now, "o", color=colour, markersize=5)
    if np.isfinite(value[0]):
        axes.axvline(scale * value[0], color="0.4", linewidth=0.8)
    axes.set_title(variable.name if np.isfinite(value[0]) else f"{variable.name}: occluded")
    axes.title.set_fontsize(9)
    axes.set(ylim=_HEIGHT, xlim=(scale * x[0], scale * x[-1]))
    axes.set_xlabel("mm", fontsize=7)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, frameon=False, loc="best")


def _draw_weights(axes: Any, facts: dict[str, Any]) -> None:
    shown = list(facts["weights"].items())[:_LARGEST_WEIGHTS]
    place = np.arange(len(shown))
    solved, corrected = ([w[when] for _, w in shown] for when in ("solved", "corrected"))
    axes.vlines(place, solved, corrected, color="0.75", linewidth=3)
    axes.plot(place, solved, "o", color="0.5", label="solved")
    axes.plot(place, corrected, "o", color=_COLOURS[0], label="corrected")
    axes.set_xticks(place, [name for name, _ in shown], fontsize=8, rotation=20, ha="right")
    title = "weights before and after the correction"
    axes.set(title=title if shown else f"{title}: none changes", ylim=_HEIGHT)
    axes.grid(axis="y", color="0.92")
    if shown:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _span(explained: Explanation) -> tuple[float, float]:
    return float(explained.times[0]), float(max(explained.times[-1], explained.times[0] + 1e-9))
