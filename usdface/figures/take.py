"""Figure of a processed take: residuals, weights with deviations, emotions."""

from collections.abc import Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.figures.picture import save_figure
from usdface.figures.terms import COLOURS
from usdface.shot.shot import ShotResult

__all__ = ["write_take_figure"]

# One colour for each region, distinguishable by the colour-blind: M. Okabe, K. Ito, 2008.
_COLOURS = {
    "brows": "#0072B2",
    "eyes": "#56B4E9",
    "nose": "#009E73",
    "cheeks": "#E69F00",
    "mouth": "#D55E00",
    "jaw": "#CC79A7",
}
# Layout: shapes drawn at most, least range of a weight that is drawn, window of the RMS curves [s],
# columns of the picture.
_LARGEST = 28
_MOVES = 0.02
_STEADY = 0.25
_COLUMNS = 2000


def write_take_figure(result: ShotResult, details: Mapping[str, Any], path: Path) -> None:
    """Draw a take: residual of each region, moving weights with their deviations, emotions.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """
    regions = details.get("residual", {}).get("regions_mm", {})
    emotions = result.emotions
    times = result.solved.times

    def draw(figure: Any) -> None:
        heights = [1.2 if regions else 0.0, 3.0, 1.0 if emotions else 0.0]
        figure.set_size_inches(14, 3.0 * sum(heights))
        shown = [height for height in heights if height]
        grid = figure.add_gridspec(len(shown), 2, height_ratios=shown, width_ratios=[6, 1])
        middle = 1 if regions else 0
        weights = figure.add_subplot(grid[middle, 0])
        names, drawn = _draw_weights(weights, result)
        aside = figure.add_subplot(grid[middle, 1], sharey=weights)
        _draw_deviations(aside, details.get("confidence", {}), names)
        if drawn is not None:
            # Recorded weights have no deviations; the colour bar takes their panel.
            place = (
                {"ax": aside} if aside.axison else {"cax": aside.inset_axes([0, 0.2, 0.12, 0.6])}
            )
            figure.colorbar(drawn, label="weight", shrink=0.5, **place)
        if regions:
            axes = figure.add_subplot(grid[0, 0], sharex=weights)
            _draw_residual(axes, result, details["residual"])
            _name_lines(axes, figure.add_subplot(grid[0, 1]))
        if emotions:
            axes = figure.add_subplot(grid[middle + 1, 0], sharex=weights)
            _draw_emotions(axes, times, emotions)
            _name_lines(axes, figure.add_subplot(grid[middle + 1, 1]))
        weights.set_xlim(times[0], _end(times))

    save_figure(draw, path)


def _draw_residual(axes: Any, result: ShotResult, residual: Mapping[str, Any]) -> None:
    times, whole = result.solved.times, residual["frames_mm"]
    axes.fill_between(times, whole, color="0.88", label="all markers", linewidth=0)
    width = max(1, round(_STEADY * result.shot.take.rate))
    for region, errors in residual["regions_mm"].items():
        label = f"{region} {errors['rms']:.2f}"
        colour = _COLOURS.get(region, "0.4")
        steady = _moving_rms(np.array(errors["frames"]), width)
        axes.plot(times, steady, label=label, linewidth=1.1, color=colour)
    title = f"distance of markers from the solved face, RMS [mm] (regions: over {_STEADY:g} s)"
    axes.set(title=title, ylim=(0, None))


def _moving_rms(values: FloatArray, width: int) -> FloatArray:
    """Return the RMS over `width` frames around each, over fewer at the ends: (F,)."""
    ones = np.ones(min(width, len(values)))
    squares = np.convolve(values**2, ones, "same") / np.convolve(np.ones(len(values)), ones, "same")
    return np.asarray(np.sqrt(squares))


def _name_lines(axes: Any, place: Any) -> None:
    """Put the legend of `axes` into `place`, so that all time axes are equally long."""
    place.axis("off")
    place.legend(*axes.get_legend_handles_labels(), loc="upper left", fontsize=8, frameon=False)


def _draw_weights(axes: Any, result: ShotResult) -> tuple[list[str], Any]:
    """Draw the largest weights as rows of an image; return their names and the image."""
    taken = result.weights
    peaks = taken.weights.max(axis=0)
    moving = np.flatnonzero(peaks > _MOVES)
    # In the order of the rig, where left and right are neighbours.
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
    kind = "solved" if result.corrected is None else "corrected"
    title = f"{kind} weights that move{more}" if names else "no weight moves"
    axes.set(title=title, xlabel="time [s]")
    return names, drawn


def _thinned(rows: FloatArray) -> FloatArray:
    """Decimate frames to the columns of a picture, keeping the largest value of each stretch."""
    starts = np.linspace(0, len(rows), min(len(rows), _COLUMNS), endpoint=False).astype(int)
    return np.asarray(np.maximum.reduceat(rows, starts, axis=0)) if rows.size else rows


def _draw_deviations(axes: Any, confidence: Mapping[str, Any], names: list[str]) -> None:
    deviations = confidence.get("standard_deviation", {})
    if not deviations:
        axes.set_axis_off()
        return
    undetermined = confidence.get("undetermined", {})
    values = [deviations.get(name, 0.0) for name in names]
    colours = ["#D55E00" if name in undetermined else "0.55" for name in names]
    axes.barh(np.arange(len(names)), values, color=colours)
    axes.tick_params(labelleft=False)
    axes.set(
        title="standard deviation\n(orange: undetermined)", xlim=(0, max([0.1, *values]) * 1.05)
    )
    axes.title.set_fontsize(9)


def _draw_emotions(axes: Any, times: FloatArray, emotions: Mapping[str, FloatArray]) -> None:
    for (name, curve), colour in zip(emotions.items(), cycle(COLOURS), strict=False):
        axes.plot(times, curve, label=name, linewidth=1.0, color=colour)
    axes.set(title="emotions", xlabel="time [s]", ylim=(-0.03, 1.05))


def _end(times: FloatArray) -> float:
    return float(max(times[-1], times[0] + 1e-9))
