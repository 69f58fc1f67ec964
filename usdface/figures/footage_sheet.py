"""Contact sheet of tracked footage: every n-th image with its labelled dots."""

from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.figures.labels import label_places, text_size
from usdface.figures.picture import save_figure
from usdface.io.images.footage import Footage

__all__ = ["write_footage_sheet"]

# Images on a sheet, in a row, and the width of each [inch].
_IMAGES, _COLUMNS, _WIDTH = 12, 4, 4.8
_FONT, _DOT = 5.5, 5.0  # of the names, and diameter of a dot that they do not cover [points]
_POINTS = 72.0  # in an inch
_DRAWN = 0.88  # of the width of an image: the bar of the colours and margins take the rest
_MOST = 14  # occluded markers that are named
_CAPTION = 7.0  # font size of captions below an image [points]
_ROOM = 0.12  # around the dots, as a share of their extent
_COLOURS = "RdYlGn"  # confidence 0 to 1


def write_footage_sheet(footage: Footage, path: Path) -> None:
    """Draw images spread over a film, cut to the face: dots as ellipses with their names.

    The colour of an ellipse is the confidence. Markers that are occluded are named below.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """
    tracks = footage.tracks
    count = len(tracks.places)
    frames = np.unique(np.linspace(0, count - 1, _IMAGES).round().astype(int)).tolist()
    low, high = np.nanmin(tracks.places, axis=(0, 1)), np.nanmax(tracks.places, axis=(0, 1))
    room = _ROOM * float((high - low).max()) + 10
    size = np.array(footage.film.header.size)
    low, high = np.maximum(low - room, 0), np.minimum(high + room, size)
    left, top = low.astype(int).tolist()
    right, bottom = high.astype(int).tolist()

    def draw(figure: Any) -> None:
        columns = min(_COLUMNS, len(frames))
        rows = -(-len(frames) // columns)
        shape = (bottom - top) / max(right - left, 1)
        figure.set_size_inches(columns * _WIDTH, rows * (_WIDTH * shape + 0.4) + 0.6)
        axes = figure.subplots(rows, columns, squeeze=False)
        for axis in axes.ravel():
            axis.set(xticks=[], yticks=[], frame_on=False)
        for axis, frame in zip(axes.ravel(), frames, strict=False):
            pixels = footage.film.frame(frame)
            if pixels is not None:
                shown = pixels[top:bottom, left:right]
                axis.imshow(shown, extent=(left, right, bottom, top), interpolation="nearest")
            axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
            _draw_dots(axis, footage, frame)
        from matplotlib.cm import ScalarMappable

        bar = figure.colorbar(
            ScalarMappable(cmap=_COLOURS), ax=axes, shrink=0.5, pad=0.01, aspect=40
        )
        bar.set_label("confidence")

    save_figure(draw, path)


def _draw_dots(axis: Any, footage: Footage, frame: int) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Ellipse

    tracks = footage.tracks
    colours = colormaps[_COLOURS]
    seen = np.flatnonzero(np.isfinite(tracks.places[frame]).all(axis=1)).tolist()
    for number in seen:
        x, y = tracks.places[frame, number].tolist()
        long, short, angle = tracks.ellipses[frame, number].tolist()
        colour = colours(tracks.confidence[frame, number])
        axis.add_patch(
            Ellipse(
                (x, y),
                2.6 * long,
                2.6 * short,
                angle=np.degrees(angle),
                fill=False,
                edgecolor=colour,
                linewidth=1.3,
            )
        )
    _name_dots(axis, tracks.places[frame, seen], [tracks.names[n] for n in seen])
    occluded = [name for number, name in enumerate(tracks.names) if number not in seen]
    more = f" and {len(occluded) - _MOST} more" if len(occluded) > _MOST else ""
    text = f"occluded: {', '.join(occluded[:_MOST])}{more}" if occluded else ""
    axis.set_title(
        f"frame {frame}" + (" (reference)" if frame == tracks.reference else ""), fontsize=9
    )
    axis.set_xlabel(_caption(text), fontsize=_CAPTION)


def _caption(text: str) -> str:
    """Break a text into lines no wider than an image: wider ones meet the next caption."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=_CAPTION)
    width = text_to_path.get_text_width_height_descent(text, font, ismath=False)[0]
    glyph = width / max(len(text), 1)
    return "\n".join(wrap(text, int(_POINTS * _DRAWN * _WIDTH / glyph))) if glyph else ""


def _name_dots(axis: Any, places: FloatArray, names: list[str]) -> None:
    """Write the names beside their dots, without overlaps, with a line to those farther off."""
    from matplotlib.patheffects import withStroke

    if not names:
        return
    left, right = axis.get_xlim()
    scale = _POINTS * _DRAWN * _WIDTH / abs(right - left)
    labels = [name.removeprefix("dot_") for name in names]
    beside = label_places(scale * places, text_size(labels, _FONT), _DOT) / scale
    for label, dot, place in zip(labels, places, beside, strict=True):
        axis.annotate(
            label,
            dot,
            place,
            ha="center",
            va="center",
            fontsize=_FONT,
            color="black",
            path_effects=[withStroke(linewidth=1.2, foreground="white")],
            arrowprops={"arrowstyle": "-", "color": "white", "linewidth": 0.5, "shrinkB": 3.0},
        )
