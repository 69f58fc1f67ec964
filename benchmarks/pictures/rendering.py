"""Pictures of a rig at some weights, by Blender's Workbench or in numpy."""

import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from examples.picture import View, render, triangulated
from usdface.arrays import FloatArray, IntArray
from usdface.blend_shape_evaluator import evaluator_of
from usdface.rigs import Rig

__all__ = ["pictures"]

SIZE = (250, 280)  # px
MIDDLE = (0.03, 0.97)  # of the moved skin
MARGIN = 1.7
LEAST = 1e-3  # m; shapes that move less say nothing of where the face is
SHARED = 0.4  # of a shape's largest motion
BACKGROUND = 0.9
SKIN = (0.55, 0.42, 0.36)  # linear
BLENDER_SCRIPT = Path(__file__).with_name("blender_frames.py")


@dataclass(frozen=True)
class _Crop:
    """The part of the character that its blend shapes move, seen from the front [m]."""

    centre: FloatArray
    height: float


def pictures(
    rig: Rig, names: Sequence[str], weights: FloatArray, blender: Path | None
) -> list[np.ndarray]:
    """Render a rig at weights (N, T) of blend shapes `names`: N images (H, W, 3) uint8."""
    points, triangles = _shown(rig, names, weights)
    crop = _crop(rig)
    if blender is not None:
        return _by_blender(points, triangles, crop, blender)
    view = View(centre=tuple(crop.centre), height=crop.height, size=SIZE)
    return [render(shown, triangles, np.full((len(triangles), 3), SKIN), view) for shown in points]


def _shown(rig: Rig, names: Sequence[str], weights: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return all meshes as one: points of each picture (N, V, 3) [m], triangles (T, 3)."""
    columns = {name: column for column, name in enumerate(names)}
    points, triangles, start = [], [], 0
    for mesh in rig.meshes:
        own = np.zeros((len(weights), len(mesh.shapes)))
        for number, name in enumerate(mesh.shape_names):
            if name in columns:
                own[:, number] = weights[:, columns[name]]
        evaluator, _ = evaluator_of(mesh, np.arange(len(mesh.points)))
        moved = evaluator.displacements(evaluator.combined(own))
        points.append(mesh.points + moved.reshape(len(weights), -1, 3))
        triangles.append(triangulated(mesh.face_counts, mesh.face_indices)[0] + start)
        start += len(mesh.points)
    return np.concatenate(points, axis=1), np.concatenate(triangles)


def _crop(rig: Rig) -> _Crop:
    moved = []
    for mesh in rig.meshes:
        for shape in mesh.shapes:
            size = np.linalg.norm(shape.offsets, axis=1)
            if size.max(initial=0.0) > LEAST:
                moved.append(mesh.points[shape.indices[size > SHARED * size.max()]])
    points = np.concatenate(moved)
    low, high = np.quantile(points, MIDDLE, axis=0)
    width, height = MARGIN * (high - low)[:2]
    return _Crop((low + high) / 2, float(max(height, width * SIZE[1] / SIZE[0])))


def _by_blender(
    points: FloatArray, triangles: IntArray, crop: _Crop, blender: Path
) -> list[np.ndarray]:
    import matplotlib.image

    with tempfile.TemporaryDirectory() as place:
        scene = Path(place) / "scene.npz"
        np.savez(
            scene,
            points=points.astype(np.float32),
            triangles=triangles.astype(np.int32),
            centre=crop.centre,
            height=crop.height,
            size=SIZE,
        )
        command = [str(blender), str(BLENDER_SCRIPT), str(scene)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        files = (scene.with_name(f"{number:04d}.png") for number in range(len(points)))
        return [_over_background(matplotlib.image.imread(file)) for file in files]


def _over_background(image: FloatArray) -> np.ndarray:
    """Return an image (H, W, 4) in [0, 1] over a plain background: (H, W, 3) uint8."""
    alpha = image[..., 3:]
    return np.round(255 * (alpha * image[..., :3] + (1 - alpha) * BACKGROUND)).astype(np.uint8)
