"""Pictures of a rig at some weights, by Blender's Workbench or in numpy."""

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.figures.render import View
from usdface.figures.rig_picture import RigTriangles, face_view, rig_pictures, rig_triangles
from usdface.rigs import Rig

__all__ = ["pictures"]

SIZE = (250, 280)  # px
BACKGROUND = 0.9
BLENDER_SCRIPT = Path(__file__).with_name("blender_frames.py")


def pictures(
    rig: Rig, names: Sequence[str], weights: FloatArray, blender: Path | None
) -> list[np.ndarray]:
    """Render a rig at weights (N, T) of blend shapes `names`: N images (H, W, 3) uint8."""
    view = face_view(rig, SIZE)
    if blender is None:
        return rig_pictures(rig, names, weights, view)
    return _by_blender(rig_triangles(rig, names, weights), view, blender)


def _by_blender(shown: RigTriangles, view: View, blender: Path) -> list[np.ndarray]:
    import matplotlib.image

    with tempfile.TemporaryDirectory() as place:
        scene = Path(place) / "scene.npz"
        np.savez(
            scene,
            points=shown.points.astype(np.float32),
            triangles=shown.triangles.astype(np.int32),
            centre=view.centre,
            height=view.height,
            size=SIZE,
        )
        command = [str(blender), str(BLENDER_SCRIPT), str(scene)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        files = (scene.with_name(f"{number:04d}.png") for number in range(len(shown.points)))
        return [_over_background(matplotlib.image.imread(file)) for file in files]


def _over_background(image: FloatArray) -> np.ndarray:
    """Return an image (H, W, 4) in [0, 1] over a plain background: (H, W, 3) uint8."""
    alpha = image[..., 3:]
    return np.round(255 * (alpha * image[..., :3] + (1 - alpha) * BACKGROUND)).astype(np.uint8)
