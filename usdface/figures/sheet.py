"""Contact sheet of a result: the solved face above the corrected one, frame by frame."""

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from usdface.figures.peak_frames import sheet_frames
from usdface.figures.picture import save_figure
from usdface.figures.rig_picture import face_view, rig_pictures
from usdface.shot.shot import ShotResult

__all__ = ["write_sheet"]

# Pictures in a row, their rows, and their size [px].
_COLUMNS, _ROWS = 6, 2
_SIZE = (250, 280)
_DPI = 110  # of saved figures
_GAP = 0.25  # between rows [inches]
_LETTERS = 34  # in a line above a picture
_LEAST_OUTPUT = 0.05  # of an emotion that is named


def write_sheet(result: ShotResult, path: Path) -> None:
    """Draw the frames of a result that are most worth a look: solved above corrected.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """
    frames = sheet_frames(result, _COLUMNS * _ROWS)
    numbers = list(frames)
    solved, final = result.solved, result.weights
    weights = np.concatenate([solved.weights[numbers], final.weights[numbers]])
    rig = result.shot.rig
    images = rig_pictures(rig, solved.names, weights, face_view(rig, _SIZE))

    def draw(figure: Any) -> None:
        columns = min(_COLUMNS, len(numbers))
        rows = -(-len(numbers) // columns)
        height = 2 * (_SIZE[1] / _DPI + 0.35) + _GAP
        figure.set_size_inches(columns * _SIZE[0] / _DPI, rows * height)
        # Each row in a figure of its own: captions keep their distance from the heads below them.
        blocks = np.ravel(figure.subfigures(rows, 1, hspace=_GAP / height))
        axes = [block.subplots(2, columns, squeeze=False) for block in blocks]
        for axis in np.ravel(axes):
            axis.set(xticks=[], yticks=[], frame_on=False)
        for place, frame in enumerate(numbers):
            block, column = divmod(place, columns)
            above, below = axes[block][:, column]
            above.imshow(images[place])
            below.imshow(images[len(numbers) + place])
            seconds = solved.times[frame] - solved.times[0]
            reasons = fill(frames[frame], _LETTERS)
            above.set_title(f"frame {frame}, {seconds:.2f} s\n{reasons}", fontsize=9)
            below.set_xlabel(_caption(result, frame), fontsize=9)
        for pair in axes:
            for axis, name in zip(pair[:, 0], ("solved", "corrected"), strict=True):
                axis.set_ylabel(name, fontsize=11)

    save_figure(draw, path)


def _caption(result: ShotResult, frame: int) -> str:
    """Return by how much a frame was changed, its strongest emotion and its residual."""
    change = np.abs(result.weights.weights[frame] - result.solved.weights[frame]).max(initial=0.0)
    outputs = {name: float(curve[frame]) for name, curve in result.emotions.items()}
    name = max(outputs, key=outputs.__getitem__, default="")
    emotion = f", {name} {outputs[name]:.2f}" if name and outputs[name] > _LEAST_OUTPUT else ""
    solution = result.solution
    residual = "" if solution is None else f"\nresidual {1000 * solution.residual[frame]:.2f} mm"
    return f"changed by {change:.2f}{emotion}{residual}"
