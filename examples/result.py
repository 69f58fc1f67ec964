"""The picture in the README: performance, retarget and correction.

``python -m examples.result`` from the project, after `usdface process examples/shot.usda`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from pxr import Usd, UsdSkel

from examples.head import build_head
from examples.performance import perform
from usdface.figures.render import View
from usdface.figures.rig_picture import render_rig
from usdface.takes import MarkerTake

__all__ = ["curves", "main"]

FOLDER = Path(__file__).resolve().parent
NEUTRAL_FRAME = 10
ROWS = (
    ("captured", "42 markers; the actor\nshows 60 to 70 %"),
    ("retargeted", "blend shapes that\nfollow the markers"),
    ("corrected", "the emotions the\nactor meant"),
)
MARKERS = "#1f6f94"
# Markers along the features of the face, joined so that dots read as a face.
LINES = tuple(
    tuple(name.replace("*", side) for name in line.split())
    for side in ("left", "right")
    for line in (
        "nose_tip nose_bridge",
        "nose_tip nose_*",
        "brow_*_inner brow_*_middle brow_*_outer",
        "lip_upper lip_upper_* lip_corner_* lip_lower_* lip_lower",
        "temple_* jaw_* chin_* chin",
    )
)


def curves(root: Path, *mute: str) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the shape names and weights (F, S) that a result plays, with layers muted."""
    stage = Usd.Stage.Open(str(root))
    for layer in mute:
        stage.MuteLayer(stage.GetRootLayer().ComputeAbsolutePath(layer))
    animation = next(UsdSkel.Animation(p) for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    weights = animation.GetBlendShapeWeightsAttr()
    samples = [weights.Get(code) for code in weights.GetTimeSamples()]
    return tuple(animation.GetBlendShapesAttr().Get()), np.array(samples)


def main() -> None:
    """Write result.png to this folder."""
    root = FOLDER / "shot.usdface.usda"
    names, corrected = curves(root)
    _, solved = curves(root, "./shot.usdface/express.usdc", "./shot.usdface/closure.usdc")
    show, rig = perform(), build_head()
    emotions = ("joy", "sadness", "anger", "fear", "disgust", "surprise")
    frames = [NEUTRAL_FRAME, *(int(show.amounts[:, e].argmax()) for e in range(6))]
    view = View(yaw=10, pitch=3, centre=(0.004, -0.018, 0), height=0.215, size=(250, 270))
    figure, axes = plt.subplots(3, 7, figsize=(12.2, 5.7), gridspec_kw={"wspace": 0, "hspace": 0})
    for column, (frame, title) in enumerate(zip(frames, ("neutral", *emotions), strict=True)):
        draw_markers(axes[0, column], show.take, frame, view)
        axes[0, column].set_title(title, fontsize=13)
        for row, weights in ((1, solved), (2, corrected)):
            pose = dict(zip(names, weights[frame].tolist(), strict=True))
            axes[row, column].imshow(render_rig(rig, pose, view))
    for axis in axes.ravel():
        axis.set(xticks=[], yticks=[], frame_on=False)
    for axis, (what, more) in zip(axes[:, 0], ROWS, strict=True):
        beside = {"xycoords": "axes fraction", "annotation_clip": False}
        axis.annotate(what, (-1.08, 0.55), fontsize=13, fontweight="bold", va="bottom", **beside)
        axis.annotate(more, (-1.08, 0.51), fontsize=9, va="top", color="0.3", **beside)
    figure.savefig(FOLDER / "result.png", dpi=100, bbox_inches="tight", metadata={"Software": None})


def draw_markers(axis: Axes, take: MarkerTake, frame: int, view: View) -> None:
    """Draw the markers of a frame as seen from `view`, around their middle."""
    turn = np.deg2rad(view.yaw)
    x, y, z = take.positions[frame].T
    seen = np.column_stack([x * np.cos(turn) - z * np.sin(turn), y])
    seen -= (np.nanmin(seen, axis=0) + np.nanmax(seen, axis=0)) / 2
    place = dict(zip(take.names, seen, strict=True))
    for line in LINES:
        axis.plot(*np.array([place[name] for name in line]).T, color=MARKERS, alpha=0.35, lw=1.2)
    axis.scatter(*seen.T, s=9, c=MARKERS, zorder=3)
    wide, high = (0.52 * view.height * n / view.size[1] for n in view.size)
    axis.set(aspect="equal", xlim=(-wide, wide), ylim=(-high, high))


if __name__ == "__main__":
    main()
