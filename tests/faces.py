"""Faces with markers, and how they play and hear a take through the real solve.

The ICT face with its 68 landmarks and with 41 markers as an optical take has them; MakeHuman's
and the example's head with the same two layouts, and with markers of their own: spread over the
skin, and as bound in the example.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from ict_face import ict_mesh, landmarks
from makehuman_face import landmarks_on, posable_face
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.correction.default_system import design
from usdface.correction.expression_layer import express
from usdface.correction.feature_extraction import sided_features
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.expression_poses import ActionPose, expressions_for
from usdface.face.marker_surface import MarkerSurface
from usdface.io.bind_file import read_bind
from usdface.io.rigs.files import read_rig_file
from usdface.io.usd.rig import read_rig
from usdface.options import CorrectionOptions
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solve_take import solve_take
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["FACES", "NOISE", "RATE", "Face", "Played", "make_face"]

ROOT = Path(__file__).resolve().parents[1]
RATE = 60.0
NOISE = 0.0003
FACES = (
    *("ict68", "ict41", "makehuman", "makehuman68", "makehuman41"),
    *("example", "example68", "example41"),
)
# Where some of ICT's landmarks are on the example's head: its own markers.
_ALIKE = {
    **{30: "nose_tip", 27: "nose_bridge", 8: "chin", 51: "lip_upper", 57: "lip_lower"},
    **{48: "lip_corner_right", 54: "lip_corner_left", 21: "brow_right_inner"},
    **{22: "brow_left_inner", 17: "brow_right_outer", 26: "brow_left_outer"},
    **{37: "lid_upper_right", 44: "lid_upper_left", 41: "lid_lower_right", 46: "lid_lower_left"},
}
Given = Mapping[str, Expression | ActionPose | None]


@dataclass(frozen=True, eq=False)
class Played:
    """What came of a take: solved and corrected weights (F, S), emotions (F, E)."""

    solved: FloatArray
    corrected: FloatArray
    emotions: FloatArray


@dataclass(frozen=True, eq=False)
class Face:
    """A mesh with blend shapes, markers on it, and the system designed for them."""

    mesh: Mesh
    setup: RetargetSetup
    expressions: tuple[Expression, ...]
    system: ExpressionSystem
    bound: BoundFace

    @property
    def poses(self) -> FloatArray:
        return np.array([e.pose(self.mesh.shape_names) for e in self.expressions])

    def markers(self, weights: FloatArray) -> FloatArray:
        """Return where the markers are on the character: (F, M, 3) [m]."""
        points = self.setup.binding.points
        flat = self.mesh.offsets_at(points).reshape(len(self.mesh.shapes), -1)
        return self.mesh.points[points] + (weights @ flat).reshape(len(weights), len(points), 3)

    def play(
        self, weights: FloatArray, rate: float = RATE, noise: float = NOISE, other: bool = False
    ) -> Played:
        """Perform weights (F, S), record noisy markers, solve and correct them.

        `other`: the performer has another face than the character. The first second is neutral.
        """
        weights = np.concatenate([np.zeros((round(rate), weights.shape[1])), weights])
        positions = self.markers(weights)
        if other:
            positions = _other(positions - positions[0].mean(axis=0))
        positions = positions + noise * np.random.default_rng(0).standard_normal(positions.shape)
        times = np.arange(len(weights)) / rate
        take = MarkerTake(self.setup.binding.markers, times, positions, rate)
        points = self.setup.binding.points
        solution, _ = solve_take(
            take,
            BoundPoints.linear(
                self.mesh.points[points], self.mesh.offsets_at(points), self.mesh.shape_names
            ),
            self.setup,
            surface=MarkerSurface(self.mesh, points),
        )
        return self.judge(take, solution.weights, solution, round(rate))

    def judge(self, take, weights: WeightsTake, solution=None, skip: int = 0) -> Played:
        """Read emotions off the weights and correct them; leave out the first frames."""
        solved = weights.weights
        result = express(
            self.system,
            sided_features(
                self.system,
                self.bound,
                take,
                weights=weights,
                solution=solution,
                expressions=self.expressions,
            ),
            self.bound,
            names=weights.names,
            weights=solved,
            expressions=self.expressions,
            times=take.times if solution else None,
        )
        answers = np.stack([result.trace.emotions[e.name] for e in self.expressions], axis=1)
        return Played(solved[skip:], result.weights[skip:], answers[skip:])

    def hear(self, weights: FloatArray) -> FloatArray:
        """Return the emotions (N, E) of poses (N, S), without take and solve."""
        times = np.arange(len(weights)) / RATE
        take = WeightsTake(self.mesh.shape_names, times, weights, RATE)
        return self.judge(take, take).emotions


def _other(positions: FloatArray) -> FloatArray:
    """Bend a face into another one: longer, narrower above, flatter, a large nose."""
    x, y, z = np.moveaxis(positions, -1, 0)
    nose = np.exp(-(x**2 + y**2) / 0.02**2)
    return np.stack([x * (0.95 - 0.8 * y), 1.08 * y, 0.93 * z + 0.006 * nose], axis=-1)


def make_face(kind: str, shared: Path, given: Given = MappingProxyType({})) -> Face:
    """Make one of `FACES`, with the expressions that are `given` besides the six."""
    made: dict[str, Callable[[Path], tuple[Mesh, RetargetSetup]]] = {
        "ict68": _ict_landmarks,
        "ict41": _ict_optical,
        "makehuman": _makehuman,
        "makehuman68": lambda folder: _on_makehuman(*_ict_landmarks(folder), folder),
        "makehuman41": lambda folder: _on_makehuman(*_ict_optical(folder), folder),
        "example": _example,
        "example68": lambda folder: _on_example(*_ict_landmarks(folder), folder),
        "example41": lambda folder: _on_example(*_ict_optical(folder), folder),
    }
    mesh, setup = made[kind](shared)
    expressions, _ = expressions_for(mesh.shape_names, given)
    system, roles, _ = design(bound_face(mesh, setup), expressions, CorrectionOptions())
    assert system is not None
    setup = replace(setup, roles=roles, neutral=(0, 29), head="solve")
    return Face(mesh, setup, expressions, system, bound_face(mesh, setup).with_layout(expressions))


def _ict_landmarks(shared: Path) -> tuple[Mesh, RetargetSetup]:
    points = landmarks(shared)
    names = tuple(f"landmark_{i}" for i in range(len(points)))
    return ict_mesh(shared), RetargetSetup(Binding(names, points), nose_tip="landmark_30")


def _ict_optical(shared: Path) -> tuple[Mesh, RetargetSetup]:
    return ict_mesh(shared), read_bind(ROOT / "tests" / "data" / "animface_ict_bind.json")[0]


def _example(_: Path) -> tuple[Mesh, RetargetSetup]:
    rig, _ = read_rig(ROOT / "examples" / "head.usdc")
    setup, _ = read_bind(ROOT / "examples" / "bind.json")
    return rig.mesh(setup.binding.mesh), setup


def _on_example(ict: Mesh, layout: RetargetSetup, shared: Path) -> tuple[Mesh, RetargetSetup]:
    """Lay the markers of the ICT face on the example's head: warped there, on the nearest skin.

    Its closed lips share places: there a marker is on the lip that opens as it does on ICT.
    """
    mesh, own = _example(shared)
    place = dict(zip(own.binding.markers, own.binding.points.tolist(), strict=True))
    known = ict.points[landmarks(shared)[list(_ALIKE)]]
    at = mesh.points[[place[name] for name in _ALIKE.values()]]
    warped = RBFInterpolator(known, at, kernel="linear", degree=1)(
        ict.points[layout.binding.points]
    )
    reach = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2).max(axis=0)
    skin = np.flatnonzero(reach > 1e-4)
    distance, near = cKDTree(mesh.points[skin]).query(warped, k=2)
    wanted = _opened(ict, layout.binding.points)[:, None]
    unlike = np.linalg.norm(_opened(mesh, skin[near]) - wanted, axis=2)
    second = np.isclose(*distance.T, rtol=0.0, atol=1e-6) & (unlike[:, 1] < unlike[:, 0])
    return mesh, _laid(layout, skin[np.where(second, near[:, 1], near[:, 0])])


def _opened(mesh: Mesh, points: IntArray) -> FloatArray:
    """Return how far an open jaw moves points (...) [m]: (..., 3)."""
    return mesh.offsets_at(points.ravel())[mesh.shape_names.index("jawOpen")].reshape(
        *points.shape, 3
    )


def _on_makehuman(_: Mesh, layout: RetargetSetup, shared: Path) -> tuple[Mesh, RetargetSetup]:
    mesh = read_rig_file(shared / "makehuman_cc0")[0].face()
    return mesh, _laid(layout, landmarks_on(posable_face(shared), shared, layout.binding.points))


def _laid(layout: RetargetSetup, points: IntArray) -> RetargetSetup:
    """Move markers to other points, without those that would share one."""
    first = np.sort(np.unique(points, return_index=True)[1])
    names = tuple(layout.binding.markers[i] for i in first)
    return RetargetSetup(Binding(names, points[first]), nose_tip=layout.nose_tip)


def _makehuman(shared: Path) -> tuple[Mesh, RetargetSetup]:
    """MakeHuman has no landmarks: the skin that each shape moves most, and between these."""
    mesh = read_rig_file(shared / "makehuman_cc0")[0].face()
    reach = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2)
    half = np.flatnonzero((reach.max(axis=0) > 0.002) & (mesh.points[:, 0] > -1e-5))
    foremost: dict[tuple[int, ...], int] = {}  # of each 4 mm: no teeth, no inside of the mouth
    for vertex in half[np.argsort(mesh.points[half, 2])]:
        foremost[tuple(np.round(mesh.points[vertex, :2] / 0.004).astype(int))] = vertex
    skin = np.array(sorted(foremost.values()))
    chosen = [int(half[np.argmax(mesh.points[half, 2])])]
    chosen += [int(v) for v in dict.fromkeys(skin[reach[:, skin].argmax(axis=1)]) if v != chosen[0]]
    while len(chosen) < 36:
        away = np.linalg.norm(mesh.points[skin, None] - mesh.points[chosen], axis=2).min(axis=1)
        chosen.append(int(skin[away.argmax()]))
    sides = [v for v in chosen if mesh.points[v, 0] > 0.002]
    mirrored = mesh.points[sides] * [-1, 1, 1]
    right = np.linalg.norm(mesh.points[:, None] - mirrored, axis=2).argmin(axis=0)
    names = ("nose", *(f"mark_{i}" for i in range(1, len(chosen))))
    names += tuple(f"mark_{chosen.index(v)}_r" for v in sides)
    return mesh, RetargetSetup(Binding(names, np.array([*chosen, *right])), nose_tip="nose")
