"""The corrector as a picture: emotions, rules, memberships, and weights before and after."""

from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from usdface.explain import Explanation
from usdface.figures.picture import save_figure
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.rules import Rule

__all__ = ["COLOURS", "write_explanation_figure"]

_COLUMNS = 4
_LARGEST_FEATURES = 8
_LARGEST_WEIGHTS = 16
_HEIGHT = (-0.03, 1.05)
_QUIET = "0.6"
_DASHES = ("-", "--", ":", "-.")
# Told apart by the colour-blind: M. Okabe, K. Ito, "Color Universal Design", 2008; two more.
COLOURS = (
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
    over_time = (1.8, 0.3 + 0.22 * max(2, len(explained.system.rules)))
    heights = (sum(over_time) + 1.2, 0.4 + 2.2 * rows, 2.8 if facts["weights"] else 0.3)

    def draw(figure: Any) -> None:
        figure.set_size_inches(12, sum(heights) + 0.6)
        figure.suptitle(_headline(facts), fontweight="bold")
        parts = figure.subfigures(3, 1, height_ratios=heights)
        emotions, fired = parts[0].subplots(2, 1, sharex=True, height_ratios=over_time)
        _draw_emotions(emotions, explained, frame)
        _draw_rules(parts[0], fired, explained, frame)
        _draw_features(parts[1], explained, facts, shown, rows)
        _draw_weights(parts[2].subplots(), explained, facts)

    save_figure(draw, path)


def _headline(facts: dict[str, Any]) -> str:
    heard = sorted(facts["emotions"].items(), key=lambda pair: -pair[1])
    said = ", ".join(f"{name} {value:.2f}" for name, value in heard if value >= 0.01)
    return f"frame {facts['frame']}, {facts['seconds']:g} s: {said or 'no emotion'}"


def _colours(explained: Explanation) -> dict[str, str]:
    names = explained.system.emotions
    return {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}


def _draw_emotions(axes: Any, explained: Explanation, frame: int) -> None:
    for (name, colour), curve in zip(_colours(explained).items(), explained.outputs.T, strict=True):
        axes.plot(explained.times, curve, color=colour, label=name)
    axes.axvline(explained.times[frame], color="0.4", linewidth=0.8)
    axes.set(title="emotions over the take", xlim=_span(explained), ylim=_HEIGHT)
    if explained.system.emotions:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)


def _draw_rules(figure: Any, axes: Any, explained: Explanation, frame: int) -> None:
    low, high = _span(explained)
    rules, colours = explained.system.rules, _colours(explained)
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
    for label, rule in zip(axes.get_yticklabels(), rules, strict=True):
        label.set_color(colours[rule.consequents[0][0]])
    axes.set(title="how far each rule fires", xlabel="time [s]")
    figure.colorbar(drawn, ax=axes, fraction=0.02, pad=0.01)


def _short(rule: Rule) -> str:
    """Return what a rule says and the first thing that it asks for."""
    says = ", ".join(output for output, _ in rule.consequents)
    first, *others = rule.propositions
    is_ = " ".join((*first.hedges, first.term))
    more = f", and {len(others)} more" if others else ""
    return f"{says}: {first.variable} {is_}{more}{'' if rule.enabled else ' (off)'}"


def _asked_most(explained: Explanation, facts: dict[str, Any]) -> list[int]:
    """Return the inputs to draw: of the rules that fire; where none does, of the nearest."""
    order = [v.name for v in explained.system.inputs]
    fired = [c["variable"] for r in facts["rules"] if r["fires"] > 0 for c in r["conditions"]]
    belongs = [max(f["terms"].values(), default=0.0) for f in facts["features"]]
    nearest = sorted(range(len(order)), key=lambda i: -belongs[i])
    columns = dict.fromkeys(map(order.index, fired) if fired else nearest)
    return [i for i in columns if explained.system.inputs[i].terms][:_LARGEST_FEATURES]


def _draw_features(
    figure: Any, explained: Explanation, facts: dict[str, Any], shown: list[int], rows: int
) -> None:
    fires = any(rule["fires"] > 0 for rule in facts["rules"])
    what = "what the rules that fire ask for" if fires else "no rule fires; the nearest features"
    figure.suptitle(
        f"{what} (line and dot: this frame; grey band: where the take goes)", fontsize=10
    )
    places = figure.subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
    for axes, column in zip(places, shown, strict=False):
        _draw_memberships(axes, explained, facts, column)
    for axes in places[len(shown) :]:
        axes.set_axis_off()


def _draw_memberships(
    axes: Any, explained: Explanation, facts: dict[str, Any], column: int
) -> None:
    """Draw the terms of an input in millimetres; those that rules that fire ask for stand out."""
    variable, scale = explained.system.inputs[column], 1000.0 * explained.unit
    values, now = explained.inputs[:, column], explained.inputs[facts["frame"], column]
    x = _reach(explained, column)
    asked = _asked(explained, facts, variable.name)
    seen = values[np.isfinite(values)]
    if seen.size:
        axes.axvspan(scale * seen.min(), scale * seen.max(), color="0.93", zorder=0)
    for term, dashes in zip(variable.terms, cycle(_DASHES), strict=False):
        colour = asked.get(term.name, _QUIET)
        width = 2.0 if term.name in asked else 1.0
        style = {"color": colour, "linewidth": width, "linestyle": dashes}
        y = membership(term.kind, term.parameters, x)
        axes.plot(scale * x, y, label=term.name, zorder=3 if term.name in asked else 2, **style)
        if np.isfinite(now):
            degree = membership(term.kind, term.parameters, np.array([now]))
            axes.plot(scale * now, degree, "o", color=colour, markersize=5, zorder=4)
    if np.isfinite(now):
        axes.axvline(scale * now, color="0.4", linewidth=0.8)
    axes.set_title(f"{variable.name}{'' if np.isfinite(now) else ': occluded'}", fontsize=9)
    axes.set(ylim=_HEIGHT, xlim=(scale * x[0], scale * x[-1]))
    axes.set_xlabel("mm from neutral", fontsize=7)
    axes.tick_params(labelsize=7)
    axes.locator_params(axis="x", nbins=5)
    axes.legend(fontsize=7, framealpha=0.85, edgecolor="none", loc="best")


def _asked(explained: Explanation, facts: dict[str, Any], name: str) -> dict[str, str]:
    """Return the terms of an input that rules that fire ask for, in the colour of their emotion."""
    colours = _colours(explained)
    asked: dict[str, str] = {}
    fired = [i for i, strength in enumerate(explained.firing[facts["frame"]]) if strength > 0]
    for rule in (explained.system.rules[i] for i in fired):
        for proposition in rule.propositions:
            if proposition.variable == name:
                asked.setdefault(proposition.term, colours[rule.consequents[0][0]])
    return asked


def _reach(explained: Explanation, column: int) -> Any:
    """Return values of an input: what the take does of it, and where its terms begin and end."""
    values = explained.inputs[:, column]
    terms = explained.system.inputs[column].terms
    marks = [p for t in terms for p in places(t.kind, t.parameters)]
    marks += [0.0, *values[np.isfinite(values)]]
    low, high = min(marks), max(marks)
    pad = 0.05 * (high - low) or 1e-9
    return np.linspace(low - pad, high + pad, 300)


def _draw_weights(axes: Any, explained: Explanation, facts: dict[str, Any]) -> None:
    shown = list(facts["weights"].items())[:_LARGEST_WEIGHTS]
    if not shown:
        axes.set_axis_off()
        axes.set_title("the correction changes no weight")
        return
    colours = _colours(explained)
    for place, (_, weight) in enumerate(shown):
        ends = weight["solved"], weight["corrected"]
        axes.plot([place, place], ends, color="0.75", linewidth=3, zorder=1)
        axes.plot(place, ends[0], "o", color="white", markeredgecolor="0.3", zorder=2)
        axes.plot(place, ends[1], "o", color=colours.get(weight["by"], _QUIET), zorder=3)
    axes.set_xticks(
        range(len(shown)), [name for name, _ in shown], fontsize=8, rotation=20, ha="right"
    )
    more = len(facts["weights"]) - len(shown)
    title = "weights as solved (white) and corrected (in the colour of the emotion that asks)"
    title += f", {more} more" if more else ""
    axes.set(title=title, ylim=_HEIGHT)
    axes.set_xlim(-0.5, max(len(shown), 4) - 0.5)
    axes.grid(axis="y", color="0.92")


def _span(explained: Explanation) -> tuple[float, float]:
    return float(explained.times[0]), float(max(explained.times[-1], explained.times[0] + 1e-9))
