"""Figure of verdicts by action units: fit of each shape to each unit, how far it went, poses."""

from pathlib import Path
from typing import Any

import numpy as np

from usdface.facs.judge import ShapeVerdict
from usdface.facs.poses import PoseVerdict
from usdface.facs.report import FacsReport
from usdface.facs.shape_claims import Claim
from usdface.figures.picture import save_figure

__all__ = ["write_facs_figure"]

# Distinguishable by the colour-blind: M. Okabe, K. Ito, 2008.
_DONE, _WRONG, _UNNAMED = "#0072B2", "#D55E00", "0.6"
_ROW, _COLUMN = 0.17, 0.19  # inch
_MOST = 150  # shapes that are drawn: those with a verdict first


def write_facs_figure(report: FacsReport, path: Path) -> None:
    """Draw the verdicts of a rig.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """
    verdicts = sorted(report.shapes.verdicts, key=_order)[:_MOST]
    columns = list(dict.fromkeys(c for v in verdicts for c in (v.claim, v.shown) if c))
    columns.sort(key=_claim_order)
    poses = [pose for pose in report.poses if pose.expected]

    def draw(figure: Any) -> None:
        height = _ROW * len(verdicts) + 1.2
        below = _ROW * len(poses) * 1.6 + 1.0 if poses else 0.0
        figure.set_size_inches(_COLUMN * len(columns) + 6.5, height + below)
        ratios = [height, below] if poses else [height]
        grid = figure.add_gridspec(
            len(ratios), 2, height_ratios=ratios, width_ratios=[_COLUMN * len(columns), 3.5]
        )
        fits = figure.add_subplot(grid[0, 0])
        image = _draw_fits(fits, report, verdicts, columns)
        _draw_moved(figure.add_subplot(grid[0, 1], sharey=fits), report, verdicts)
        figure.colorbar(image, ax=fits, location="top", shrink=0.4, label="fit to each unit")
        if poses:
            _draw_poses(figure.add_subplot(grid[1, :]), poses)

    save_figure(draw, path)


def _claim_order(claim: Claim) -> tuple[int, str, str]:
    number = claim.movement.split()[0].rstrip("LR")
    return (int(number) if number.isdigit() else 1000, claim.movement, claim.side)


def _order(verdict: ShapeVerdict) -> tuple[Any, ...]:
    first = verdict.claim or Claim("mouth right", "~")
    return (*_claim_order(first), verdict.name)


def _colour(verdict: ShapeVerdict) -> str:
    return {"done": _DONE, "unnamed": _UNNAMED}.get(verdict.verdict, _WRONG)


def _draw_fits(
    axes: Any, report: FacsReport, verdicts: list[ShapeVerdict], columns: list[Claim]
) -> Any:
    fits = report.shapes.fits
    rows = [report.rig.shape_names.index(verdict.name) for verdict in verdicts]
    chosen = [fits.candidates.index(claim) for claim in columns]
    values = fits.cosines[np.ix_(rows, chosen)].clip(0.0, 1.0)
    image = axes.imshow(values, vmin=0.0, vmax=1.0, cmap="Greys", aspect="auto")
    for row, verdict in enumerate(verdicts):
        for claim, colour in ((verdict.shown, _colour(verdict)), (verdict.claim, _DONE)):
            if claim is not None:
                place = (columns.index(claim) - 0.5, row - 0.5)
                box = axes.add_patch(_square(place, colour))
                box.set_linestyle("-" if claim == verdict.shown else ":")
    axes.set_yticks(range(len(verdicts)), [verdict.name for verdict in verdicts], fontsize=7)
    for label, verdict in zip(axes.get_yticklabels(), verdicts, strict=True):
        label.set_color("black" if verdict.verdict == "done" else _colour(verdict))
    axes.set_xticks(range(len(columns)), [str(c) for c in columns], rotation=90, fontsize=7)
    return image


def _square(place: tuple[float, float], colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle(place, 1.0, 1.0, fill=False, edgecolor=colour, linewidth=1.2)


def _draw_moved(axes: Any, report: FacsReport, verdicts: list[ShapeVerdict]) -> None:
    rows = range(len(verdicts))
    moved = [verdict.moved_mm if verdict.claim else 0.0 for verdict in verdicts]
    axes.barh(rows, moved, color=[_colour(verdict) for verdict in verdicts], height=0.7)
    axes.axvline(report.noise, color="0.5", linewidth=0.8, linestyle="--")
    axes.axvline(0.0, color="black", linewidth=0.6)
    words = {"done": "", "unnamed": "no unit named"}
    far = max([*moved, report.noise])
    for row, verdict in enumerate(verdicts):
        about = words.get(verdict.verdict, verdict.verdict.replace("_", " "))
        if verdict.verdict == "swapped":
            about += f" with {verdict.partner}"
        elif about and verdict.shown and verdict.verdict != "unnamed":
            about += f": {verdict.shown}" + (f" and {verdict.second}" if verdict.second else "")
        axes.text(max(moved[row], 0.0) + 0.02 * far, row, about, fontsize=7, va="center")
    axes.tick_params(labelleft=False, labelsize=7)
    axes.set_title("displacement of the unit's points [mm]; dashed: noise", fontsize=8)
    axes.set_xlim(min(0.0, *moved) if moved else 0.0, 1.5 * far)


def _draw_poses(axes: Any, poses: list[PoseVerdict]) -> None:
    units = list(dict.fromkeys(amount.unit for pose in poses for amount in pose.expected))
    units.sort(key=lambda unit: _claim_order(Claim(unit)))
    for row, pose in enumerate(poses):
        for amount in pose.expected:
            colour = _DONE if amount.done else _WRONG
            text = f"{amount.mm:.1f}"
            axes.text(units.index(amount.unit), row, text, color=colour, ha="center", va="center")
    axes.set(xlim=(-0.5, len(units) - 0.5), ylim=(len(poses) - 0.5, -0.5))
    axes.set_xticks(range(len(units)), [f"AU{unit}" for unit in units], fontsize=8)
    axes.set_yticks(range(len(poses)), [pose.name for pose in poses], fontsize=8)
    axes.set_title("expression poses: displacement of each unit [mm], orange: not seen", fontsize=8)
