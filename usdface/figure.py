"""The corrector as a picture (matplotlib, the extra `plot`)."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.explain import Explanation
from usdface.fuzzy.membership import membership
from usdface.io.atomic import write_bytes

__all__ = ["check_picture", "save_figure", "write_figure"]

_LARGEST_FEATURES = 9
_LARGEST_WEIGHTS = 14
_SUFFIXES = (".png", ".svg", ".pdf")


def write_figure(explained: Explanation, frame: int, path: Path) -> None:
    """Draw a take's emotions and rules, and one frame's memberships and weights.

    Raises
    ------
    InputError
        If matplotlib is not installed, the file name is no picture's, or there is no such frame.
    OutputError
        If the file cannot be written.
    """
    facts = explained.frame(frame)

    def draw(figure: Any) -> None:
        figure.set_size_inches(12, 10)
        curves, rules, features, weights = figure.subplots(
            4, 1, height_ratios=[1.2, 1.2, 1.4, 1.2]
        ).tolist()
        _draw_emotions(curves, explained, frame)
        _draw_rules(rules, explained, frame)
        _draw_features(features, explained, frame, facts)
        _draw_weights(weights, facts)

    save_figure(draw, path)


def save_figure(draw: Callable[[Any], None], path: Path) -> None:
    """Let `draw` fill a figure, and write it; the same figure gives the same bytes.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the file name is no picture's.
    OutputError
        If the file cannot be written.
    """
    check_picture(path)
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("figures need matplotlib: pip install 'usdface[plot]'") from error
    figure = Figure(layout="constrained")
    draw(figure)
    drawn = io.BytesIO()
    # Without date and random names, so that the same take gives the same bytes.
    metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    suffix = path.suffix.lower()
    with rc_context({"svg.hashsalt": "usdface"}):
        figure.savefig(drawn, format=suffix[1:], dpi=110, metadata=metadata[suffix])
    write_bytes(path, drawn.getvalue())


def check_picture(path: Path) -> None:
    """Refuse a file name that is no picture's.

    Raises
    ------
    InputError
        If it ends in something else.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"{path} is no picture; end it in {', '.join(_SUFFIXES)}")


def _draw_emotions(axes: Any, explained: Explanation, frame: int) -> None:
    for name, curve in zip(explained.system.emotions, explained.outputs.T, strict=True):
        axes.plot(explained.times, curve, label=name)
    axes.axvline(explained.times[frame], color="0.4", linewidth=0.8)
    axes.set(title="emotions", xlabel="time [s]", ylim=(0, 1.02), xlim=_span(explained))
    axes.legend(loc="upper right", ncols=6, fontsize=8)


def _draw_rules(axes: Any, explained: Explanation, frame: int) -> None:
    low, high = _span(explained)
    count = len(explained.system.rules)
    axes.imshow(
        explained.firing.T,
        aspect="auto",
        vmin=0,
        vmax=1,
        cmap="magma",
        extent=(low, high, count, 0),
    )
    axes.axvline(explained.times[frame], color="0.8", linewidth=0.8)
    labels = [str(rule).removeprefix("'").removesuffix("'") for rule in explained.system.rules]
    short = [text if len(text) < 70 else f"{text[:34]} ... {text[-32:]}" for text in labels]
    axes.set_yticks(np.arange(count) + 0.5, short, fontsize=6)
    axes.set(title="how far each rule fires", xlabel="time [s]")


def _draw_features(axes: Any, explained: Explanation, frame: int, facts: dict[str, Any]) -> None:
    """Draw the memberships of the features that count most now, each on its own span."""
    fires = [max(f["terms"].values(), default=0.0) for f in facts["features"]]
    seen = np.atleast_1d(np.isfinite(explained.inputs).any(axis=0))
    order = [i for i in np.argsort(fires)[::-1].tolist() if seen[i]][:_LARGEST_FEATURES]
    for place, column in enumerate(order):
        variable = explained.system.inputs[column]
        low, high = np.nanmin(explained.inputs[:, column]), np.nanmax(explained.inputs[:, column])
        x = np.linspace(low, high, 200) if high > low else np.array([low, low + 1e-9])
        across = place + 0.05 + 0.85 * (x - x[0]) / (x[-1] - x[0])
        for term in variable.terms:
            axes.plot(across, membership(term.kind, term.parameters, x), label=term.name)
        value = explained.inputs[frame, column]
        if np.isfinite(value):
            now = place + 0.05 + 0.85 * (value - x[0]) / (x[-1] - x[0])
            axes.axvline(now, color="0.4", linewidth=0.8)
    names = [explained.system.inputs[column].name for column in order]
    axes.set_xticks(np.arange(len(names)) + 0.47, names, fontsize=7, rotation=12)
    axes.set(title="memberships over the take's range; line = this frame", ylim=(0, 1.02))


def _draw_weights(axes: Any, facts: dict[str, Any]) -> None:
    shown = list(facts["weights"].items())[:_LARGEST_WEIGHTS]
    place = np.arange(len(shown))
    axes.bar(place - 0.2, [w["solved"] for _, w in shown], 0.4, label="solved", color="0.7")
    axes.bar(place + 0.2, [w["corrected"] for _, w in shown], 0.4, label="corrected")
    axes.set_xticks(place, [name for name, _ in shown], fontsize=7, rotation=20, ha="right")
    title = f"weights that the correction changes at frame {facts['frame']}"
    axes.set(title=title if shown else f"{title}: none", ylim=(0, 1.02))
    axes.legend(loc="upper right", fontsize=8)


def _span(explained: Explanation) -> tuple[float, float]:
    return float(explained.times[0]), float(max(explained.times[-1], explained.times[0] + 1e-9))
