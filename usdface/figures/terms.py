"""Membership curves of an input, the same in all figures."""

from typing import Any

__all__ = ["COLOURS", "draw_value", "name_terms"]

# Distinguishable by the colour-blind: M. Okabe, K. Ito, "Color Universal Design", 2008; two more.
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
_LOW, _HIGH = -0.03, 1.05  # limits of the axis: lines at 0 and 1 stay visible
# Layout: height of a row of names as a share of the panel; longest names of which two columns fit.
_ROW = 0.19
_LONGEST, _COLUMNS = 18, 2


def draw_value(axes: Any, value: float, colour: str) -> None:
    """Draw a value of the input as a line that ends below the legend."""
    axes.vlines(value, _LOW, _HIGH, color=colour, linewidth=0.8)


def name_terms(axes: Any, font: float) -> None:
    """Write the legend of `axes` above its curves, where it hides none."""
    curves, names = axes.get_legend_handles_labels()
    columns = _COLUMNS if len(names) > 1 and max(map(len, names)) <= _LONGEST else 1
    rows = -(-len(names) // columns)
    axes.set_ylim(_LOW, _HIGH + _ROW * rows)
    axes.set_yticks([0.0, 0.5, 1.0])
    if names:
        axes.legend(
            curves,
            names,
            fontsize=font,
            loc="upper left",
            ncols=columns,
            frameon=False,
            borderaxespad=0.2,
            borderpad=0.2,
            labelspacing=0.2,
            columnspacing=1.0,
            handlelength=1.8,
        )
