"""Figure of a binding: markers on the face from the front and the side."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.face_surface import face_surface
from usdface.figures.labels import label_places, text_size
from usdface.figures.picture import save_figure
from usdface.geometry.face_corners import next_corners
from usdface.rigs import Mesh
from usdface.setup.binding import Binding

__all__ = ["write_bind_figure"]

# Horizontal and vertical axis of each view, and its title.
_VIEWS = ((0, 1, "front"), (2, 1, "the face's left side"))
# Layout: margin as a share of the markers' extent, height without title [inch], points per inch,
# font size and marker diameter [points].
_MARGIN = 0.12
_HIGH = 9.0
_POINTS = 72.0
_FONT, _DOT = 6.5, 6.0


def write_bind_figure(
    mesh: Mesh, binding: Binding, path: Path, *, unsure: Binding | None = None
) -> None:
    """Draw the bound markers from the front and the side, coloured by their confidence if any.

    `unsure` markers, whose vertices are proposed and not bound, are drawn as well.

    Raises
    ------
    InputError
        If matplotlib is not installed, the suffix is not .png, .svg or .pdf, or
        the blend shapes move
        no visible surface.
    OutputError
        If the file cannot be written.
    """
    if unsure is not None and unsure.markers:
        binding = _joined(binding, unsure)
    edges, points = _edges(mesh, face_surface(mesh).vertices), mesh.points[binding.points]
    framed = points if len(points) else edges.reshape(-1, 3)
    low, high = framed.min(axis=0), framed.max(axis=0)
    margin = _MARGIN * max(float((high - low).max()), 1e-3)
    low, high = low - margin, high + margin
    scale = _HIGH / float(high[1] - low[1])
    wide = [scale * float(high[across] - low[across]) for across, _, _ in _VIEWS]

    def draw(figure: Any) -> None:
        figure.set_size_inches(sum(wide) + 2.0, _HIGH + 0.6)
        drawn = None
        places = figure.subplots(1, 2, sharey=True, width_ratios=wide).tolist()
        for axes, (across, up, title) in zip(places, _VIEWS, strict=True):
            # Markers and edges that the head hides from its left are left out.
            shown = np.flatnonzero(points[:, 0] > -0.005) if across == 2 else np.arange(len(points))
            flat = points[shown][:, [across, up]]
            seen = edges[(edges[..., 0] > -0.005).all(axis=1)] if across == 2 else edges
            _draw_edges(axes, seen[..., [across, up]])
            drawn = _draw_markers(axes, flat, binding, shown)
            _name_markers(axes, flat, [binding.markers[i] for i in shown.tolist()], scale)
            axes.set(title=title, aspect="equal", xticks=[], yticks=[])
            axes.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]))
        if binding.confidence is not None:
            figure.colorbar(drawn, ax=places, label="confidence", shrink=0.6)

    save_figure(draw, path)


def _joined(binding: Binding, unsure: Binding) -> Binding:
    """Return the markers of both bindings; a missing confidence counts as 1."""
    shares = [
        np.ones(len(each.markers)) if each.confidence is None else each.confidence
        for each in (binding, unsure)
    ]
    return Binding(
        binding.markers + unsure.markers,
        np.concatenate([binding.points, unsure.points]),
        binding.mesh,
        np.concatenate(shares),
    )


def _edges(mesh: Mesh, vertices: IntArray) -> FloatArray:
    """Return the edges of the mesh between these vertices: (N, 2, 3) [m]."""
    following = mesh.face_indices[next_corners(mesh.face_counts)]
    pairs = np.column_stack([mesh.face_indices, following])
    kept = np.isin(pairs, vertices).all(axis=1)
    return np.asarray(mesh.points[np.unique(np.sort(pairs[kept], axis=1), axis=0)])


def _draw_edges(axes: Any, flat: FloatArray) -> None:
    from matplotlib.collections import LineCollection

    # Thousands of lines: rasterised also in vector formats.
    axes.add_collection(
        LineCollection(list(flat), colors="0.84", linewidths=0.5, zorder=0, rasterized=True)
    )


def _draw_markers(axes: Any, flat: FloatArray, binding: Binding, shown: Any) -> Any:
    style = {"edgecolors": "0.2", "linewidths": 0.5, "s": _DOT**2}
    if binding.confidence is None:
        return axes.scatter(*flat.T, color="#0072B2", **style)
    confidence = np.nan_to_num(binding.confidence[shown], nan=1.0)
    return axes.scatter(*flat.T, c=confidence, cmap="RdYlGn", vmin=0.0, vmax=1.0, **style)


def _name_markers(axes: Any, flat: FloatArray, names: list[str], scale: float) -> None:
    """Write the names without overlaps, with leader lines where they are not at their marker."""
    places = label_places(_POINTS * scale * flat, text_size(names, _FONT), _DOT)
    for name, point, place in zip(names, flat, places / (_POINTS * scale), strict=True):
        axes.annotate(
            name,
            point,
            xytext=place,
            ha="center",
            va="center",
            fontsize=_FONT,
            zorder=3,
            arrowprops={"arrowstyle": "-", "color": "0.5", "linewidth": 0.5, "shrinkB": 2.0},
        )
