"""The picture in the README: what the performer did, what was retargeted, what was corrected.

``python -m examples.result`` from the project, after `usdface process examples/shot.usda`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from pxr import Usd, UsdSkel

from examples.head import build_head
from examples.performance import perform
from examples.picture import View, render_rig

__all__ = ["curves", "main"]

FOLDER = Path(__file__).resolve().parent
NEUTRAL_FRAME = 10
ROWS = ("markers (performer at 60 %)", "retarget: solve layer", "corrected: express layer")


def curves(root: Path, mute: str = "") -> tuple[tuple[str, ...], np.ndarray]:
    """Return the shape names and weights (F, S) that a result plays, with a layer muted."""
    stage = Usd.Stage.Open(str(root))
    if mute:
        stage.MuteLayer(stage.GetRootLayer().ComputeAbsolutePath(mute))
    animation = next(UsdSkel.Animation(p) for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    weights = animation.GetBlendShapeWeightsAttr()
    samples = [weights.Get(code) for code in weights.GetTimeSamples()]
    return tuple(animation.GetBlendShapesAttr().Get()), np.array(samples)


def main() -> None:
    """Write result.png to this folder."""
    root = FOLDER / "shot.usdface.usda"
    names, corrected = curves(root)
    _, solved = curves(root, "./shot.usdface/express.usdc")
    show, rig = perform(), build_head()
    emotions = ("joy", "sadness", "anger", "fear", "disgust", "surprise")
    frames = [NEUTRAL_FRAME, *(int(show.amounts[:, e].argmax()) for e in range(6))]
    view = View(yaw=22, pitch=3, centre=(0, -0.005, 0), height=0.29, size=(280, 330))
    figure, axes = plt.subplots(3, 7, figsize=(12, 6.6), gridspec_kw={"wspace": 0, "hspace": 0.02})
    for column, (frame, title) in enumerate(zip(frames, ("neutral", *emotions), strict=True)):
        x, y, z = show.take.positions[frame].T
        turn = np.deg2rad(view.yaw)
        axes[0, column].scatter(x * np.cos(turn) - z * np.sin(turn), y, s=7, c="#2a6f8f")
        axes[0, column].set_aspect("equal")
        axes[0, column].set_title(title, fontsize=11)
        for row, weights in ((1, solved), (2, corrected)):
            pose = dict(zip(names, weights[frame].tolist(), strict=True))
            axes[row, column].imshow(render_rig(rig, pose, view))
    for axis in axes.ravel():
        axis.set(xticks=[], yticks=[], frame_on=False)
    for row, label in enumerate(ROWS):
        axes[row, 0].set_ylabel(label, fontsize=9)
        axes[row, 0].set_frame_on(False)
    figure.savefig(FOLDER / "result.png", dpi=100, bbox_inches="tight", metadata={"Software": None})


if __name__ == "__main__":
    main()
