"""Printing for `usdface fuzzy`: fitted systems, explained frames, neutral checks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from usdface.cli.report import print_whole, shown

if TYPE_CHECKING:
    from usdface.correction.neutral_check import NeutralResponse
    from usdface.rule_learning.fitting import Fitted

__all__ = ["print_explanation", "print_fit", "print_neutral_responses"]

# A difference of two outputs that is worth a line.
_LEAST_SHOWN = 0.05


def print_fit(fitted: "Fitted") -> None:
    """Print a fitted system: rules, cross-validation, and the motions that separate emotions."""
    console = Console(highlight=False, soft_wrap=True)
    for rule in fitted.system.fuzzy.rules:
        console.print(shown(" ".join(rule.text.split())))
    tested = fitted.validation
    if tested is not None and tested.tested:
        title = f"true (rows) and predicted emotions, each {tested.holding} held out"
        table = Table(title=title, title_justify="left", box=SIMPLE)
        labels = [*tested.names, "none"]
        for label in ("", *labels, "margin: mean", "worst"):
            table.add_column(shown(label), justify="right" if label else "left", no_wrap=True)
        for label, row in zip(labels, tested.counts, strict=True):
            margins = tested.margins_of("" if label == "none" else label)
            figures = [f"{margins.mean():+.2f}", f"{margins.min():+.2f}"] if margins.size else []
            table.add_row(shown(label), *(str(n) if n else "." for n in row), *figures)
        print_whole(console, table)
    if fitted.separations:
        title = "motions that separate two emotions best, in standard deviations"
        table = Table(title=title, title_justify="left", box=SIMPLE)
        tests = any(pair.tested for pair in fitted.separations)
        for column in ("emotions", "motions", "deviations", *(["confused"] if tests else [])):
            table.add_column(column, no_wrap=True)
        for pair in sorted(fitted.separations, key=lambda pair: pair.sensitivity):
            mistaken = f"{pair.mistaken} of {pair.tested}" if pair.tested else "not tested"
            cells = " / ".join(pair.emotions), ", ".join(pair.features)
            distance = f"{pair.sensitivity:.1f}"
            table.add_row(*map(shown, cells), distance, *([mistaken] if tests else []))
        print_whole(console, table)


def print_explanation(facts: dict[str, Any]) -> None:
    """Print features, rules and weights of a frame (`Explanation.frame`)."""
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"frame {facts['frame']}, {facts['time_s']:g} s", style="bold")
    _print_emotions(console, facts)
    fired = [rule for rule in facts["rules"] if rule["fires"] > 0]
    title = "rules that fire" if fired else "no rule fires; emotions have their defaults"
    console.print(f"\n{title}", style="bold")
    _print_rules(console, fired)
    for side, half in facts["halves"].items():
        other = "right" if side == "left" else "left"
        console.print(f"\nthe {side} half, mirrored to the {other}", style="bold")
        _print_emotions(console, half)
        _print_rules(console, [rule for rule in half["rules"] if rule["fires"] > 0])
    used = {part["variable"] for rule in fired for part in rule["conditions"]}
    table = Table(title="\nother features", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for column in ("change", "feature", "terms"):
        table.add_column(column, justify="right" if column == "change" else "left")
    for feature in facts["features"]:
        terms = ", ".join(f"{name} {value:.2f}" for name, value in feature["terms"].items())
        if feature["name"] not in used:
            table.add_row(_distance(feature), shown(feature["name"]), shown(terms))
    if table.row_count:
        console.print(table)
    if facts["closed"]:
        parts = "  ".join(f"{name} {share:.2f}" for name, share in facts["closed"].items())
        console.print(shown(f"\nclosed: {parts}"))
    if facts["weights"]:
        console.print("\nweights, solved and corrected", style="bold")
    for shape, weight in facts["weights"].items():
        by = f"  ({weight['by']})" if weight["by"] else ""
        line = f"{weight['solved']:.2f} -> {weight['corrected']:.2f}  {shape}{by}"
        console.print(shown(line))


def _print_emotions(console: Console, facts: dict[str, Any]) -> None:
    emotions = (f"{name} {value:.2f}" for name, value in facts["emotions"].items())
    console.print(shown("  ".join(emotions)))
    for name, value in facts["emotions"].items():
        if abs(value - (rules := facts["by_rules"][name])) >= _LEAST_SHOWN:
            found = "it" if value > rules else "another emotion or none"
            line = f"{name} is {rules:.2f} by its rules; the classifier of the face finds {found}"
            console.print(shown(line))
    poses = [f"{name} {value:.2f}" for name, value in facts["poses_shown"].items() if value > 0]
    if poses:
        console.print(shown(f"intensity of the pose: {'  '.join(poses)}"))
    for name, regions in facts["held_back"].items():
        line = f"{name} is held back: not shown in {' and '.join(regions)}"
        console.print(shown(line))


def _print_rules(console: Console, rules: Sequence[dict[str, Any]]) -> None:
    for rule in rules:
        console.print(shown(f"{rule['fires']:.2f}  {rule['rule']}"))
        for condition in rule["conditions"]:
            line = f"        {_distance(condition)}  {condition['variable']} is {condition['is']}"
            console.print(shown(f"{line} {condition['degree']:.2f}"))


def _distance(fact: dict[str, Any]) -> str:
    """Return a marker's displacement relative to the nose tip, ten characters wide."""
    return f"{'occluded' if fact['mm'] is None else format(fact['mm'], '+.2f') + ' mm':>10}"


def print_neutral_responses(responses: "Sequence[NeutralResponse]") -> None:
    """Print the outputs of systems for a neutral face, side by side."""
    console = Console(highlight=False, soft_wrap=True)
    columns: dict[str, dict[str, float]] = {}
    for response in responses:
        columns[f"{response.system}: neutral"] = response.exact
        if response.mean is not None and response.largest is not None:
            columns["jitter, mean"], columns["largest"] = response.mean, response.largest
    table = Table(title="outputs for a neutral face", title_justify="left", box=SIMPLE)
    for name in ("", *columns):
        table.add_column(shown(name), justify="right" if name else "left", no_wrap=True)
    for emotion in dict.fromkeys(e for column in columns.values() for e in column):
        cells = (f"{c[emotion]:.3f}" if emotion in c else "" for c in columns.values())
        table.add_row(shown(emotion), *cells)
    print_whole(console, table)
    noise = "0.3 mm of noise on a human face"
    console.print(f"jitter: 20 s of neutral markers with {noise}, solved", style="dim")
    for response in responses:
        if response.rules:
            console.print(shown(f"rules that fire at neutral, {response.system}:"), style="bold")
        for rule in response.rules:
            console.print(shown(f"  {rule}"))
