"""The faces of the benchmark, their markers, and the curves that drive them.

With the real data folder: the ICT face with 24, 41, 68 or 150 markers, MakeHuman's with 68, and
recorded range-of-motion curves. Without: the example's head with its 42 markers and its curves.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.curve_mapping import rename_weights
from usdface.io.bind_file import read_bind
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.files import read_take
from usdface.io.usd.rig import read_rig
from usdface.rigs import BlendShape, Mesh

__all__ = [
    "RANGE_OF_MOTION",
    "Face",
    "bent",
    "example",
    "has_real_data",
    "ict",
    "makehuman",
    "random_bend",
]

ROOT = Path(__file__).resolve().parents[2]
RANGE_OF_MOTION = "livelinkface/alex_rom_3.csv"
# Of the 68 landmarks (iBUG numbering): brows, nose, lids, mouth, chin.
FEW = (8, 17, 19, 21, 22, 24, 26, 30, 31, 35, 37, 40, 44, 47, 48, 50, 52, 54, 56, 58, 4, 12, 62, 66)
# Which recorded curve moves which of MakeHuman's shapes; those with none rest.
MAKEHUMAN = {
    "eye-left-closure": "EyeBlinkLeft",
    "eye-right-closure": "EyeBlinkRight",
    "eye-left-opened-up": "EyeWideLeft",
    "eye-right-opened-up": "EyeWideRight",
    "eye-left-slit": "EyeSquintLeft",
    "eye-right-slit": "EyeSquintRight",
    "eyebrows-left-down": "BrowDownLeft",
    "eyebrows-right-down": "BrowDownRight",
    "eyebrows-left-inner-up": "BrowInnerUp",
    "eyebrows-right-inner-up": "BrowInnerUp",
    "eyebrows-left-extern-up": "BrowOuterUpLeft",
    "eyebrows-right-extern-up": "BrowOuterUpRight",
    "mouth-open": "JawOpen",
    "mouth-corner-puller": "MouthSmileLeft",
    "mouth-depression": "MouthFrownLeft",
    "mouth-elevation": "MouthUpperUpLeft",
    "mouth-eversion": "MouthFunnel",
    "mouth-protusion": "MouthPucker",
    "mouth-retraction": "MouthStretchLeft",
    "mouth-compression": "MouthPressLeft",
    "mouth-pursing": "MouthRollLower",
    "mouth-part-later": "MouthLowerDownLeft",
    "mouth-upward-retraction": "MouthDimpleLeft",
    "nose-left-elevation": "NoseSneerLeft",
    "nose-right-elevation": "NoseSneerRight",
    "nose-compression": "CheekPuff",
}


@dataclass(frozen=True, eq=False)
class Face:
    """A mesh with markers on it, and curves (F, S) in [0, 1] at `rate` [Hz] that drive it.

    `lips` are a vertex of the upper and one of the lower lip that meet in the middle.
    """

    mesh: Mesh
    points: IntArray
    curves: FloatArray
    rate: float
    lips: tuple[int, int] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"marker_{k}" for k in range(len(self.points)))

    @property
    def neutral(self) -> FloatArray:
        """Return where the markers rest: (M, 3) [m]."""
        return self.mesh.points[self.points]

    @property
    def offsets(self) -> FloatArray:
        """Return what each shape adds to the markers: (S, M, 3) [m]."""
        return self.mesh.offsets_at(self.points)


def has_real_data(data: Path) -> bool:
    return (data / RANGE_OF_MOTION).is_file() and (data / "ict_facekit").is_dir()


def ict(data: Path, markers: int = 68) -> Face:
    places = json.loads((data / "ict_facekit" / "vertex_indices.json").read_text())
    packed = np.load(data / "ict_facekit" / "ict_expressions.npz")
    shapes = tuple(
        BlendShape(name, packed[f"idx_{name}"], 0.01 * packed[f"off_{name}"].astype(np.float64))
        for name in places["expressions"]
    )
    points = 0.01 * packed["points"].astype(np.float64)
    counts, indices = packed["faceVertexCounts"], packed["faceVertexIndices"]
    mesh = Mesh("Face", points, counts, indices, shapes=shapes)
    landmarks = np.array(places["idx_to_landmark_verts"])
    if markers == 24:
        chosen = landmarks[list(FEW)]
    elif markers == 41:
        chosen = read_bind(ROOT / "tests" / "data" / "animface_ict_bind.json")[0].binding.points
    else:
        chosen = spread_out(mesh, landmarks, markers)
    recorded, _ = read_take(data / RANGE_OF_MOTION)
    curves = rename_weights(recorded, mesh.shape_names)[0].weights
    return Face(mesh, chosen, curves, recorded.rate, (int(landmarks[62]), int(landmarks[66])))


def makehuman(data: Path) -> Face:
    mesh = read_rig_file(data / "makehuman_cc0")[0].face()
    recorded, _ = read_take(data / RANGE_OF_MOTION)
    curves = np.zeros((len(recorded.times), len(mesh.shapes)))
    columns = {name.lower(): column for column, name in enumerate(recorded.names)}
    for shape, curve in MAKEHUMAN.items():
        column = recorded.weights[:, columns[curve.lower()]]
        curves[:, mesh.shape_names.index(shape)] = column.clip(0, 1)
    moved = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2)
    most = np.array(list(dict.fromkeys(moved.argmax(axis=1).tolist())))
    return Face(mesh, spread_out(mesh, most, 68), curves, recorded.rate)


def example(_: Path | None = None) -> Face:
    from examples.performance import perform

    mesh = read_rig(ROOT / "examples" / "head.usdc")[0].mesh("head")
    binding = read_bind(ROOT / "examples" / "bind.json")[0].binding
    performed = perform().weights.reordered(mesh.shape_names)
    at = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    lips = at["lip_upper"], at["lip_lower"]
    return Face(mesh, binding.points, performed.weights, performed.rate, lips)


def spread_out(mesh: Mesh, first: IntArray, count: int) -> IntArray:
    """Add to the first vertices those of the moving skin that are farthest from all before."""
    if len(first) >= count:
        return first[:count]
    moved = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2).max(axis=0)
    front = mesh.points[:, 2] > np.quantile(mesh.points[first, 2], 0.05)
    skin = np.flatnonzero((moved > 0.002) & front)
    away = np.linalg.norm(mesh.points[skin, None] - mesh.points[first], axis=2).min(axis=1)
    chosen = list(first)
    while len(chosen) < count:
        vertex = skin[away.argmax()]
        chosen.append(vertex)
        away = np.minimum(away, np.linalg.norm(mesh.points[skin] - mesh.points[vertex], axis=1))
    return np.array(chosen)


def random_bend(
    seed: int, points: FloatArray, around: FloatArray, size: float, width: float
) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 3) after a smooth random bend, and its Jacobian there (N, 3, 3).

    Eight bumps of so much and so wide [m], near points of `around`.
    """
    rng = np.random.default_rng(seed)
    centres = around[rng.integers(len(around), size=8)] + 0.02 * rng.normal(size=(8, 3))
    moves = size * rng.normal(size=(8, 3))
    away = points[:, None] - centres
    bumps = np.exp(-(away**2).sum(axis=2) / (2 * width**2))
    slopes = np.einsum("mk,kd,mke->mde", bumps, moves, -away / width**2, optimize=True)
    return points + bumps @ moves, np.eye(3) + slopes


def bent(face: Face, seed: int, size: float, width: float = 0.06) -> Face:
    """Bend a face at random by eight bumps of so much [m], its shapes by the bend's Jacobian."""
    points, turn = random_bend(seed, face.mesh.points, face.neutral, size, width)
    shapes = tuple(
        BlendShape(s.name, s.indices, np.einsum("nde,ne->nd", turn[s.indices], s.offsets))
        for s in face.mesh.shapes
    )
    mesh = replace(face.mesh, points=points, shapes=shapes, normals=None)
    return replace(face, mesh=mesh)
