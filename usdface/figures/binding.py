"""A binding as a picture: markers on the face from the front and the side."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.binding.skin import skin_of
from usdface.figures.picture import save_figure
from usdface.rigs import Mesh
from usdface.setup import Binding
from usdface.takes import FloatArray

__all__ = ["write_bind_figure"]

# Axes across and up, and what they are called.
_VIEWS = ((0, 1, "front"), (2, 1, "the face's left side"))


def write_bind_figure(mesh: Mesh, binding: Binding, path: Path) -> None:
    """Draw where each marker sits, coloured by its confidence, from the front and the side.

    Raises
    ------
    InputError
        If matplotlib is not installed, the file name is no picture's, or the mesh has no skin.
    OutputError
        If the file cannot be written.
    """
    skin = skin_of(mesh).points

    def draw(figure: Any) -> None:
        figure.set_size_inches(15, 9.5)
        drawn = None
        for axes, (across, up, title) in zip(figure.subplots(1, 2).tolist(), _VIEWS, strict=True):
            drawn = _draw(axes, skin, mesh.points[binding.points], binding, across, up)
            axes.set(title=title, aspect="equal", xticks=[], yticks=[])
        if drawn is not None:
            figure.colorbar(drawn, ax=figure.axes, label="confidence", shrink=0.6)

    save_figure(draw, path)


def _draw(
    axes: Any, skin: FloatArray, points: FloatArray, binding: Binding, across: int, up: int
) -> Any:
    axes.plot(skin[:, across], skin[:, up], ".", color="0.75", markersize=1.5, zorder=0)
    shown = np.arange(len(points))
    if across == 2:
        # What the head hides from its left is left out.
        shown = np.flatnonzero(points[:, 0] > -0.005)
    sure = np.full(len(points), 1.0) if binding.confidence is None else binding.confidence
    drawn = axes.scatter(
        points[shown, across],
        points[shown, up],
        c=np.nan_to_num(sure[shown], nan=1.0),
        cmap="RdYlGn",
        vmin=0.0,
        vmax=1.0,
        edgecolors="0.2",
        linewidths=0.5,
        s=36,
    )
    for i in shown.tolist():
        axes.annotate(
            binding.markers[i],
            (points[i, across], points[i, up]),
            textcoords="offset points",
            xytext=(3, 4),
            fontsize=6,
        )
    return drawn
