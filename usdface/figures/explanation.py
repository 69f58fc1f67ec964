"""Figure of an explanation: emotions, rules, memberships, weights before and after."""

from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.figures.picture import save_figure
from usdface.figures.terms import COLOURS, draw_value, name_terms
from usdface.fuzzy.membership import membership, places
from usdface.fuzzy.norms import HEDGES
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Term
from usdface.shot.explanation import HALF_APART, Explanation

__all__ = ["write_explanation_figure"]

# Layout: panels in a row, features and weights drawn, range of the membership axis.
_COLUMNS = 4
_LARGEST_FEATURES = 8
_LARGEST_WEIGHTS = 16
_HEIGHT = (-0.03, 1.05)
# Layout: names of emotions that fit one below the other beside their curves.
_EMOTIONS_BESIDE = 9
_QUIET = "0.6"
_DASHES = ("-", "--", ":", "-.")
# Rows of rules; of more rules, those that fire most.
_MOST_RULES = 60


def write_explanation_figure(explained: Explanation, frame: int, path: Path) -> None:
    """Draw a take's emotions and rules, and one frame's memberships and weights.

    Raises
    ------
    InputError
        If matplotlib is not installed, the suffix is not .png, .svg or .pdf, or
        there is no such frame.
    OutputError
        If the file cannot be written.
    """
    facts = explained.frame(frame)
    shown = _relevant_inputs(explained, facts)
    rows = max(1, -(-len(shown) // _COLUMNS))
    over_time = (1.8, 0.3 + 0.22 * min(max(2, len(explained.system.fuzzy.rules)), _MOST_RULES))
    heights = (sum(over_time) + 1.2, 0.4 + 2.2 * rows, 2.8 if facts["weights"] else 0.3)

    def draw(figure: Any) -> None:
        figure.set_size_inches(12, sum(heights) + 0.6)
        figure.suptitle(_headline(facts), fontweight="bold")
        parts = figure.subfigures(3, 1, height_ratios=heights)
        emotions, fired = parts[0].subplots(2, 1, sharex=True, height_ratios=over_time)
        _draw_emotions(emotions, explained, frame)
        _draw_rules(fired, explained, frame)
        _draw_features(parts[1], explained, facts, shown, rows)
        _draw_weights(parts[2].subplots(), explained, facts)

    save_figure(draw, path)


def _headline(facts: dict[str, Any]) -> str:
    headline = _emotion_list(facts["emotions"]) or "no emotion"
    for side, half in facts["halves"].items():
        headline += f"; {side} half: {_emotion_list(half['emotions']) or 'none'}"
    return f"frame {facts['frame']}, {facts['time_s']:.2f} s: {headline}"


def _emotion_list(emotions: dict[str, float]) -> str:
    ordered = sorted(emotions.items(), key=lambda pair: -pair[1])
    return ", ".join(f"{name} {value:.2f}" for name, value in ordered if value >= 0.01)


def _colours(explained: Explanation) -> dict[str, str]:
    names = explained.system.emotions
    return {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}


def _draw_emotions(axes: Any, explained: Explanation, frame: int) -> None:
    for i, (name, curve) in enumerate(
        zip(explained.system.emotions, explained.whole.evaluation.outputs.T, strict=True)
    ):
        # More emotions than colours: the next ones have another line style.
        again, colour = divmod(i, len(COLOURS))
        style = {"color": COLOURS[colour], "linestyle": _DASHES[again % len(_DASHES)]}
        axes.plot(explained.times, curve, label=name, **style)
        for (side, half), dashes in zip(explained.halves.items(), ("--", ":"), strict=False):
            if (
                np.abs(half.intensity[:, i] - explained.whole.intensity[:, i]).max(initial=0.0)
                >= HALF_APART
            ):
                thin = {"color": COLOURS[colour], "linestyle": dashes, "linewidth": 1.0}
                axes.plot(
                    explained.times,
                    half.evaluation.outputs[:, i],
                    label=f"{name}, {side} half",
                    **thin,
                )
    axes.axvline(explained.times[frame], color="0.4", linewidth=0.8)
    axes.set(title="emotions over the take", xlim=_span(explained), ylim=_HEIGHT)
    if explained.system.mode == "raise":
        for level, meaning in zip(explained.system.response, ("begins", "whole"), strict=True):
            axes.axhline(level, color="0.5", linewidth=0.8, linestyle=":", zorder=0)
            place = {"xy": (0.003, level), "xycoords": ("axes fraction", "data")}
            axes.annotate(f"pose {meaning}", fontsize=7, color="0.4", va="bottom", **place)
    axes.set_yticks([0.0, 0.5, 1.0])
    count = len(axes.get_legend_handles_labels()[1])
    if count:
        outside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
        columns = -(-count // _EMOTIONS_BESIDE)
        axes.legend(fontsize=8, frameon=False, ncols=columns, **outside)


def _draw_rules(axes: Any, explained: Explanation, frame: int) -> None:
    """Draw a row for each rule: its firing strength, in the colour of its emotion."""
    rules, colours = explained.system.fuzzy.rules, _colours(explained)
    peaks = explained.trace.firing.max(axis=0, initial=0.0)
    shown = np.sort(np.argsort(-peaks, kind="stable")[:_MOST_RULES]).tolist()
    for row, i in enumerate(shown):
        colour = colours[rules[i].consequents[0][0]]
        top = row + 1.0 - explained.trace.firing[:, i]
        axes.fill_between(explained.times, row + 1.0, top, color=colour, linewidth=0)
        axes.axhline(row + 1.0, color="0.85", linewidth=0.6, zorder=0)
    axes.axvline(explained.times[frame], color="0.4", linewidth=0.8)
    axes.set_yticks(np.arange(len(shown)) + 0.5, [_short(rules[i]) for i in shown], fontsize=7)
    axes.tick_params(axis="y", length=0)
    for label, i in zip(axes.get_yticklabels(), shown, strict=True):
        label.set_color(colours[rules[i].consequents[0][0]])
    few = f" (the {len(shown)} of {len(rules)} that fire most)" if len(shown) < len(rules) else ""
    axes.set(title=f"firing strength of each rule, 0 to 1 in a row{few}", xlabel="time [s]")
    axes.set(xlim=_span(explained), ylim=(max(1, len(shown)) + 0.05, -0.05))


def _short(rule: Rule) -> str:
    """Return the consequents and the first condition of a rule."""
    outputs = ", ".join(output for output, _ in rule.consequents)
    first, *others = rule.propositions
    is_ = " ".join((*first.hedges, first.term))
    more = f", and {len(others)} more" if others else ""
    return f"{outputs}: {first.variable} {is_}{more}{'' if rule.enabled else ' (off)'}"


def _relevant_inputs(explained: Explanation, facts: dict[str, Any]) -> list[int]:
    """Return the inputs to draw: those of firing rules, else of the rule nearest to firing."""
    order = [v.name for v in explained.system.fuzzy.inputs]
    fired = [c["variable"] for r in facts["rules"] if r["fires"] > 0 for c in r["conditions"]]
    memberships = [max(f["terms"].values(), default=0.0) for f in facts["features"]]
    nearest = sorted(range(len(order)), key=lambda i: -memberships[i])
    columns = dict.fromkeys(map(order.index, fired) if fired else nearest)
    return [i for i in columns if explained.system.fuzzy.inputs[i].terms][:_LARGEST_FEATURES]


def _draw_features(
    figure: Any, explained: Explanation, facts: dict[str, Any], shown: list[int], rows: int
) -> None:
    fires = any(rule["fires"] > 0 for rule in facts["rules"])
    contents = (
        "conditions of the rules that fire" if fires else "no rule fires; the nearest features"
    )
    figure.suptitle(
        f"{contents} (line and dot: this frame; grey band: range of the take)", fontsize=10
    )
    places = figure.subplots(rows, _COLUMNS, squeeze=False).ravel().tolist()
    for axes, column in zip(places, shown, strict=False):
        _draw_memberships(axes, explained, facts, column)
    for axes in places[len(shown) :]:
        axes.set_axis_off()


def _draw_memberships(
    axes: Any, explained: Explanation, facts: dict[str, Any], column: int
) -> None:
    """Draw the terms of an input in millimetres; those of firing rules are emphasised."""
    variable, scale = explained.system.fuzzy.inputs[column], 1000.0 * explained.trace.unit
    values = explained.whole.inputs[:, column]
    now = explained.whole.inputs[facts["frame"], column]
    x = _reach(explained, column)
    conditions = _fired_conditions(explained, facts, variable.name)
    seen = values[np.isfinite(values)]
    if seen.size:
        axes.axvspan(scale * seen.min(), scale * seen.max(), color="0.93", zorder=0)
    for term, dashes in zip(variable.terms, cycle(_DASHES), strict=False):
        # Conditions of rules, such as "not raised", in colour; other terms in grey.
        for hedges, colour in (conditions.get(term.name) or {(): _QUIET}).items():
            fired = term.name in conditions
            at = np.array([now]) if np.isfinite(now) else np.zeros(0)
            y, degree = (_degree(term, hedges, v) for v in (x, at))
            style = {"color": colour, "linestyle": dashes, "linewidth": 2.0 if fired else 1.0}
            above = 3 if fired else 2
            name = " ".join((*hedges, term.name))
            axes.plot(scale * x, y, label=name, zorder=above, **style)
            axes.plot(scale * at, degree, "o", color=colour, markersize=5, zorder=4)
    if np.isfinite(now):
        draw_value(axes, scale * now, "0.4")
    axes.set_title(f"{variable.name}{'' if np.isfinite(now) else ': occluded'}", fontsize=9)
    axes.set_xlim(scale * x[0], scale * x[-1])
    axes.set_xlabel("mm from neutral", fontsize=7)
    axes.tick_params(labelsize=7)
    axes.locator_params(axis="x", nbins=5)
    name_terms(axes, 7)


def _degree(term: Term, hedges: tuple[str, ...], values: FloatArray) -> FloatArray:
    degree = membership(term.kind, term.parameters, values)
    for hedge in reversed(hedges):
        degree = HEDGES[hedge](degree)
    return degree


def _fired_conditions(
    explained: Explanation, facts: dict[str, Any], name: str
) -> dict[str, dict[tuple[str, ...], str]]:
    """Return the conditions of firing rules on an input: term, hedges, colour of the emotion."""
    colours = _colours(explained)
    conditions: dict[str, dict[tuple[str, ...], str]] = {}
    fired = [i for i, strength in enumerate(explained.trace.firing[facts["frame"]]) if strength > 0]
    for rule in (explained.system.fuzzy.rules[i] for i in fired):
        for proposition in rule.propositions:
            if proposition.variable == name:
                hedged = conditions.setdefault(proposition.term, {})
                hedged.setdefault(proposition.hedges, colours[rule.consequents[0][0]])
    return conditions


def _reach(explained: Explanation, column: int) -> Any:
    """Return the range of an input: of its values in the take, and of its terms."""
    values = explained.whole.inputs[:, column]
    terms = explained.system.fuzzy.inputs[column].terms
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
    title = "weights as solved (white) and corrected (in the colour of the emotion)"
    title += f", {more} more" if more else ""
    axes.set(title=title, ylim=_HEIGHT)
    axes.set_xlim(-0.5, max(len(shown), 4) - 0.5)
    axes.grid(axis="y", color="0.92")


def _span(explained: Explanation) -> tuple[float, float]:
    return float(explained.times[0]), float(max(explained.times[-1], explained.times[0] + 1e-9))
