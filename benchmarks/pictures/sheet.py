"""Contact sheets: the performer's markers, the raw solve and the corrected face, frame by frame."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from benchmarks.pictures.rendering import SIZE
from usdface.shot.shot import ShotResult
from usdface.takes import MarkerTake

__all__ = ["draw_sheets"]

COLUMNS = 6
DPI = 100
LETTERS = 34  # in a line above a picture


def draw_sheets(
    title: str,
    result: ShotResult,
    frames: dict[int, str],
    raw: Sequence[np.ndarray],
    corrected: Sequence[np.ndarray],
    path: Path,
) -> list[Path]:
    """Draw frames with their reasons to files PATH_1.png, PATH_2.png, ... and return these."""
    still = _still_markers(result)
    numbers = list(frames)
    change = np.abs(result.weights.weights - result.solved.weights).max(axis=1)
    written = []
    for start in range(0, len(numbers), COLUMNS):
        part = numbers[start : start + COLUMNS]
        rows = 2 if still is None else 3
        figure, axes = plt.subplots(
            rows,
            COLUMNS,
            figsize=(COLUMNS * SIZE[0] / DPI, rows * SIZE[1] / DPI + 0.9),
            squeeze=False,
            gridspec_kw={"wspace": 0.02, "hspace": 0.09},
        )
        for axis in axes.ravel():
            axis.set(xticks=[], yticks=[], frame_on=False)
        for column, frame in enumerate(part):
            seconds = result.solved.times[frame] - result.solved.times[0]
            if still is not None:
                _draw_markers(axes[0, column], still, frame)
            reasons = fill(frames[frame], LETTERS)
            axes[0, column].set_title(f"frame {frame}, {seconds:.2f} s\n{reasons}", fontsize=10)
            axes[-2, column].imshow(raw[start + column])
            axes[-1, column].imshow(corrected[start + column])
            caption = f"changed by {change[frame]:.2f}{_strongest(result, frame)}"
            none = "no expression layer"
            axes[-1, column].set_xlabel(none if result.corrected is None else caption)
        labels = ("markers", "raw", "corrected")[-rows:]
        for axis, label in zip(axes[:, 0], labels, strict=True):
            axis.set_ylabel(label, fontsize=13)
        figure.suptitle(title, y=0.995, fontsize=13)
        figure.subplots_adjust(left=0.025, right=0.998, top=0.9, bottom=0.035)
        name = path.with_name(f"{path.name}_{start // COLUMNS + 1}.png")
        figure.savefig(name, dpi=DPI, metadata={"Software": None})
        plt.close(figure)
        written.append(name)
    return written


def _strongest(result: ShotResult, frame: int) -> str:
    values = {name: float(curve[frame]) for name, curve in result.emotions.items()}
    name = max(values, key=values.__getitem__, default="")
    return f", {name} {values[name]:.2f}" if name and values[name] > 0.05 else ""


def _still_markers(result: ShotResult) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the markers without the head's motion (F, M, D), and where they rest (M, D)."""
    take, solution = result.shot.take, result.solution
    if solution is None or not isinstance(take, MarkerTake):
        return None
    return solution.still(take), solution.neutral


def _draw_markers(axis: Axes, still: tuple[np.ndarray, np.ndarray], frame: int) -> None:
    """Draw the markers from the front, with lines from where they rest."""
    shown, rest = still[0][frame, :, :2], still[1][:, :2]
    axis.plot(*np.stack([rest, shown], axis=1).transpose(2, 1, 0), color="0.6", lw=1.5)
    axis.scatter(*shown.T, s=14, c="#1f6f94", zorder=3)
    low, high = rest.min(axis=0), rest.max(axis=0)
    centre, half = (low + high) / 2, 0.6 * float((high - low).max())
    wide = half * SIZE[0] / SIZE[1]
    axis.set(aspect="equal", xlim=(centre[0] - wide, centre[0] + wide))
    axis.set(ylim=(centre[1] - half, centre[1] + half))
