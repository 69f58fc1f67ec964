"""A processed take as one picture: how far off, which weights, how sure, which emotions."""

from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.figures.picture import save_figure
from usdface.figures.terms import COLOURS
from usdface.retarget_shot import Animated

__all__ = ["write_take_figure"]

# One colour a region, told apart by the colour-blind: M. Okabe, K. Ito, 2008.
_COLOURS = {
    "brows": "#0072B2",
    "eyes": "#56B4E9",
    "nose": "#009E73",
    "cheeks": "#E69F00",
    "mouth": "#D55E00",
    "jaw": "#CC79A7",
}
_LARGEST = 28
_MOVES = 0.02
_STEADY = 0.25  # s
_COLUMNS = 2000


def write_take_figure(animated: Animated, path: Path) -> None:
    """Draw a take: residual of each region, the weights that move with their deviations, emotions.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the file name is no picture's.
    OutputError
        If the file cannot be written.
    """
    regions = animated.details.get("residual", {}).get("regions mm", {})
    emotions = animated.express.emotions if animated.express else {}

    def draw(figure: Any) -> None:
        heights = [1.2 if regions else 0.0, 3.0, 1.0 if emotions else 0.0]
        figure.set_size_inches(14, 3.0 * sum(heights))
        shown = [height for height in heights if height]
        grid = figure.add_gridspec(len(shown), 2, height_ratios=shown, width_ratios=[6, 1])
        middle = 1 if regions else 0
        weights = figure.add_subplot(grid[middle, 0])
        names, drawn = _draw_weights(weights, animated)
        aside = figure.add_subplot(grid[middle, 1], sharey=weights)
        _draw_deviations(aside, animated, names)
        if drawn is not None:
            # Without deviations, as of recorded weights, their place is the scale's.
            place = (
                {"ax": aside} if aside.axison else {"cax": aside.inset_axes([0, 0.2, 0.12, 0.6])}
            )
            figure.colorbar(drawn, label="weight", shrink=0.5, **place)
        if regions:
            axes = figure.add_subplot(grid[0, 0], sharex=weights)
            _draw_residual(axes, animated, regions)
            _name_lines(axes, figure.add_subplot(grid[0, 1]))
        if emotions:
            axes = figure.add_subplot(grid[middle + 1, 0], sharex=weights)
            _draw_emotions(axes, animated.take.times, emotions)
            _name_lines(axes, figure.add_subplot(grid[middle + 1, 1]))
        weights.set_xlim(animated.take.times[0], _end(animated.take.times))

    save_figure(draw, path)


def _draw_residual(axes: Any, animated: Animated, regions: dict[str, Any]) -> None:
    times, whole = animated.take.times, animated.details["residual"]["frames mm"]
    axes.fill_between(times, whole, color="0.88", label="all markers", linewidth=0)
    width = max(1, round(_STEADY * animated.take.rate))
    for region, said in regions.items():
        label = f"{region} {said['rms']:.2f}"
        colour = _COLOURS.get(region, "0.4")
        steady = _moving_rms(np.array(said["frames"]), width)
        axes.plot(times, steady, label=label, linewidth=1.1, color=colour)
    title = f"how far markers are from the solved face, RMS [mm] (regions: over {_STEADY:g} s)"
    axes.set(title=title, ylim=(0, None))


def _moving_rms(values: FloatArray, width: int) -> FloatArray:
    """Return the RMS over `width` frames around each, over fewer at the ends: (F,)."""
    ones = np.ones(min(width, len(values)))
    squares = np.convolve(values**2, ones, "same") / np.convolve(np.ones(len(values)), ones, "same")
    return np.asarray(np.sqrt(squares))


def _name_lines(axes: Any, place: Any) -> None:
    """Put the legend of `axes` where `place` is, so that all time axes are as long."""
    place.axis("off")
    place.legend(*axes.get_legend_handles_labels(), loc="upper left", fontsize=8, frameon=False)


def _draw_weights(axes: Any, animated: Animated) -> tuple[list[str], Any]:
    """Draw the shapes that move most, rows of a map; return their names and the map, if any."""
    taken = animated.weights
    peaks = taken.weights.max(axis=0)
    moving = np.flatnonzero(peaks > _MOVES)
    # In the order of the rig, which keeps left and right together.
    order = np.sort(moving[np.argsort(-peaks[moving], kind="stable")][:_LARGEST])
    rows = _thinned(taken.weights[:, order])
    extent = (taken.times[0], _end(taken.times), max(len(order), 1) - 0.5, -0.5)
    drawn = None
    if len(order):
        drawn = axes.imshow(
            rows.T,
            aspect="auto",
            interpolation="nearest",
            extent=extent,
            vmin=0,
            vmax=1,
            cmap="magma",
        )
    names = [taken.names[k] for k in order.tolist()]
    axes.set_yticks(np.arange(len(names)), names, fontsize=7)
    more = f", the {len(names)} largest of {len(moving)}" if len(moving) > len(names) else ""
    kind = "corrected" if animated.express else "solved"
    title = f"{kind} weights that move{more}" if names else "no weight moves"
    axes.set(title=title, xlabel="time [s]")
    return names, drawn


def _thinned(rows: FloatArray) -> FloatArray:
    """Return at most so many frames as a picture has columns, each the largest of its stretch."""
    starts = np.linspace(0, len(rows), min(len(rows), _COLUMNS), endpoint=False).astype(int)
    return np.asarray(np.maximum.reduceat(rows, starts, axis=0)) if rows.size else rows


def _draw_deviations(axes: Any, animated: Animated, names: list[str]) -> None:
    said = animated.details.get("confidence", {})
    deviations = said.get("standard deviation", {})
    if not deviations:
        axes.set_axis_off()
        return
    hidden = said.get("hardly seen, and the vertex that would show it", {})
    values = [deviations.get(name, 0.0) for name in names]
    colours = ["#D55E00" if name in hidden else "0.55" for name in names]
    axes.barh(np.arange(len(names)), values, color=colours)
    axes.tick_params(labelleft=False)
    axes.set(
        title="standard deviation\n(orange: hardly seen)", xlim=(0, max([0.1, *values]) * 1.05)
    )
    axes.title.set_fontsize(9)


def _draw_emotions(axes: Any, times: FloatArray, emotions: dict[str, FloatArray]) -> None:
    for (name, curve), colour in zip(emotions.items(), cycle(COLOURS), strict=False):
        axes.plot(times, curve, label=name, linewidth=1.0, color=colour)
    axes.set(title="emotions", xlabel="time [s]", ylim=(-0.03, 1.05))


def _end(times: FloatArray) -> float:
    return float(max(times[-1], times[0] + 1e-9))
