"""Faces with markers, and what their expression layer answers after the real solve.

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

from usdface.express import Character, design, express, features, halves, parts_of
from usdface.fuzzy.contact import gaps_of, hold
from usdface.fuzzy.dictionaries import ActionPose, expressions_for
from usdface.fuzzy.parts import FaceParts
from usdface.fuzzy.selection import single_movements
from usdface.fuzzy.system import FuzzySystem
from usdface.io.bind_file import read_bind
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.files import read_take
from usdface.io.usd.rig import read_rig
from usdface.options import CorrectionOptions
from usdface.retarget.names import rename_weights
from usdface.retarget.transfer import solve_take
from usdface.rigs import Mesh
from usdface.setup import Binding, Expression, Setup
from usdface.takes import FloatArray, IntArray, MarkerTake, WeightsTake

__all__ = [
    "AMOUNTS",
    "FACES",
    "NOISE",
    "RATE",
    "Face",
    "Played",
    "contact",
    "loudest_alone",
    "make_face",
    "one_sided",
    "others_heard",
    "range_of_motion",
    "sweep",
    "weak_expressions",
]

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
AMOUNTS = (0.4, 0.55, 0.7)

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
    setup: Setup
    expressions: tuple[Expression, ...]
    system: FuzzySystem
    parts: FaceParts

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
            self.mesh.points[points],
            self.mesh.offsets_at(points),
            self.mesh.shape_names,
            self.setup,
        )
        return self.judge(take, solution.weights, solution, round(rate))

    def judge(self, take, weights: WeightsTake, solution=None, skip: int = 0) -> Played:
        """Read emotions off the weights and correct them; leave out the first frames."""
        read = (self.system, take, self.mesh, self.setup, weights, solution)
        names, solved = weights.names, weights.weights
        corrected, emotions, _ = express(
            self.system,
            features(*read),
            names,
            solved,
            self.expressions,
            Character(self.mesh, self.parts),
            halves(*read),
            take.times if solution else None,
        )
        answers = np.stack([emotions[e.name] for e in self.expressions], axis=1)
        return Played(solved[skip:], corrected[skip:], answers[skip:])

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
    made: dict[str, Callable[[Path], tuple[Mesh, Setup]]] = {
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
    system, designed, _ = design(mesh, setup, expressions, CorrectionOptions())
    assert system is not None
    parts = parts_of(mesh, designed, expressions)
    setup = replace(designed, neutral=(0, 29), head="solve")
    return Face(mesh, setup, expressions, system, parts)


def _ict_landmarks(shared: Path) -> tuple[Mesh, Setup]:
    points = landmarks(shared)
    names = tuple(f"landmark_{i}" for i in range(len(points)))
    return ict_mesh(shared), Setup(Binding(names, points), nose_tip="landmark_30")


def _ict_optical(shared: Path) -> tuple[Mesh, Setup]:
    return ict_mesh(shared), read_bind(ROOT / "tests" / "data" / "animface_ict_bind.json")[0]


def _example(_: Path) -> tuple[Mesh, Setup]:
    rig, _ = read_rig(ROOT / "examples" / "head.usdc")
    setup, _ = read_bind(ROOT / "examples" / "bind.json")
    return rig.mesh(setup.binding.mesh), setup


def _on_example(ict: Mesh, layout: Setup, shared: Path) -> tuple[Mesh, Setup]:
    """Lay the markers of the ICT face on the example's head: warped there, on the nearest skin."""
    mesh, own = _example(shared)
    place = dict(zip(own.binding.markers, own.binding.points.tolist(), strict=True))
    known = ict.points[landmarks(shared)[list(_ALIKE)]]
    at = mesh.points[[place[name] for name in _ALIKE.values()]]
    warped = RBFInterpolator(known, at, kernel="linear", degree=1)(
        ict.points[layout.binding.points]
    )
    reach = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2).max(axis=0)
    skin = np.flatnonzero(reach > 1e-4)
    return mesh, _laid(layout, skin[cKDTree(mesh.points[skin]).query(warped)[1]])


def _on_makehuman(_: Mesh, layout: Setup, shared: Path) -> tuple[Mesh, Setup]:
    mesh = read_rig_file(shared / "makehuman_cc0")[0].face()
    return mesh, _laid(layout, landmarks_on(posable_face(shared), shared, layout.binding.points))


def _laid(layout: Setup, points: IntArray) -> Setup:
    """Move markers to other points, without those that would share one."""
    first = np.sort(np.unique(points, return_index=True)[1])
    names = tuple(layout.binding.markers[i] for i in first)
    return Setup(Binding(names, points[first]), nose_tip=layout.nose_tip)


def _makehuman(shared: Path) -> tuple[Mesh, Setup]:
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
    return mesh, Setup(Binding(names, np.array([*chosen, *right])), nose_tip="nose")


def range_of_motion(face: Face, shared: Path) -> tuple[FloatArray, float]:
    """Return recorded weights (F, S) that mean no emotion, and their rate [Hz]."""
    recorded, _ = read_take(shared / "livelinkface" / "alex_rom_3.csv")
    renamed, _ = rename_weights(recorded, face.mesh.shape_names)
    return np.clip(renamed.weights, 0, 1), recorded.rate


def loudest_alone(face: Face) -> dict[str, dict[str, float]]:
    """Return which emotions above 0.1 each blend shape alone, or with its twin, is taken for."""
    names = face.mesh.shape_names
    moves = single_movements(names)
    heard = {}
    for row, outputs in zip(moves, face.hear(moves), strict=True):
        loud = {e.name: float(o) for e, o in zip(face.expressions, outputs, strict=True) if o > 0.1}
        if loud:
            heard[" + ".join(n for n, w in zip(names, row, strict=True) if w)] = loud
    return heard


def others_heard(face: Face) -> FloatArray:
    """Return the loudest other emotion at each expression with one more movement: (N,)."""
    moves = single_movements(face.mesh.shape_names)
    found = []
    for i, pose in enumerate(face.poses):
        heard = face.hear(np.clip(pose + moves, 0.0, 1.0))
        found.append(np.delete(heard, i, axis=1).max(axis=1))
    return np.concatenate(found)


@dataclass(frozen=True, eq=False)
class Sweep:
    """How an expression is heard while it rises from 0 to 1.

    Attributes
    ----------
    right : float
        Share of the frames, from an intensity of 0.15 on, in which it is the strongest.
    error : float
        Largest difference of output and intensity.
    fall : float
        Largest fall of the output below what it has been.
    rest : float
        Largest output of any emotion on the neutral face that follows.
    """

    right: float
    error: float
    fall: float
    rest: float


def sweep(face: Face) -> dict[str, Sweep]:
    """Raise each expression pose from 0 to 1 in 400 frames, and let it go."""
    rise = np.linspace(0, 1, 401)  # every 20th frame is a step of 5 %
    level = np.concatenate([rise, np.ones(30), np.linspace(1, 0, 60), np.zeros(90)])
    heard = face.play(np.concatenate([level[:, None] * pose for pose in face.poses])).emotions
    answer = {}
    for i, expression in enumerate(face.expressions):
        part = heard[i * len(level) : (i + 1) * len(level)]
        own = part[:401, i]
        strongest = part[:401].argmax(axis=1) == i
        answer[expression.name] = Sweep(
            float(strongest[rise >= 0.15].mean()),
            float(np.abs(own - rise).max()),
            float((np.maximum.accumulate(own) - own).max()),
            float(part[-45:].max()),
        )
    return answer


@dataclass(frozen=True, eq=False)
class Weak:
    """Under-expressive performances corrected.

    Attributes
    ----------
    share : dict of str to list of float
        For each emotion and each of `AMOUNTS`: distance to the whole expression after the
        correction by that before, while the expression is held.
    neutral : float
        Mean change of a weight on neutral frames.
    roughness : float
        RMS second difference of the correction by that of the solved weights.
    jump : float
        Largest change of the correction from one frame to the next.
    """

    share: dict[str, list[float]]
    neutral: float
    roughness: float
    jump: float


def weak_expressions(face: Face) -> Weak:
    """Show every expression at each of `AMOUNTS`, on another face, for 0.6 s."""
    ease = np.linspace(0, 1, 24)
    ease = ease**2 * (3 - 2 * ease)
    envelope = np.concatenate([np.zeros(40), ease, np.ones(36), ease[::-1]])
    shown = [amount * envelope[:, None] * pose for pose in face.poses for amount in AMOUNTS]
    played = face.play(np.concatenate(shown), other=True)
    correction = played.corrected - played.solved
    share: dict[str, list[float]] = {}
    for i, _ in enumerate(shown):
        held = slice(i * len(envelope) + 64, i * len(envelope) + 100)
        expression = face.expressions[i // len(AMOUNTS)]
        pose = face.poses[i // len(AMOUNTS)]
        before, after = (
            np.linalg.norm(w[held] - pose, axis=1).mean() for w in (played.solved, played.corrected)
        )
        share.setdefault(expression.name, []).append(float(after / before))
    neutral = np.abs(correction).reshape(len(shown), len(envelope), -1)[:, 8:30].mean()
    jump = np.abs(np.diff(correction, axis=0)).max()
    return Weak(
        share, float(neutral), roughness(correction) / roughness(played.solved), float(jump)
    )


@dataclass(frozen=True, eq=False)
class Contact:
    """What a correction does where lips or lids touch, over closed frames [mm].

    Attributes
    ----------
    opened, crossed : dict of str to (float, float)
        For "lips" and "lids": by how much they open at most where they touch, and how far they are
        pushed into each other beyond the rig's own expressions: without and with the limit.
    """

    opened: dict[str, tuple[float, float]]
    crossed: dict[str, tuple[float, float]]


def contact(face: Face) -> Contact:
    """Raise every expression whole over closed lips, closed lids and a pressed mouth.

    The gaps are those of each pair of vertices on the deformed mesh, averaged over the places of
    `usdface.fuzzy.contact`.
    """
    names = face.mesh.shape_names
    closing = [
        [float("blink" in n.lower() or n.endswith("closure")) for n in names],
        [0.5 * ("press" in n.lower()) for n in names],
        [0.0] * len(names),
    ]
    solved = np.repeat(np.array(closing), len(face.poses), axis=0)
    wanted = np.maximum(solved, np.tile(face.poses, (len(closing), 1)))
    gaps = gaps_of(face.mesh, face.parts, names, face.poses)
    held, _, _ = hold(solved, wanted, gaps)
    before = gaps.at(solved)
    shut = before < gaps.touch + gaps.tolerance
    opened, crossed = {}, {}
    for seam in ("lips", "lids"):
        own = shut & np.array([name.endswith(seam) for name in gaps.seam])
        after = [gaps.at(weights) for weights in (wanted, held)]
        most = [1000 * float((gap - np.maximum(before, gaps.touch))[own].max()) for gap in after]
        deep = [1000 * float((np.minimum(before, gaps.floor) - gap)[own].max()) for gap in after]
        opened[seam], crossed[seam] = (most[0], most[1]), (max(deep[0], 0.0), max(deep[1], 0.0))
    return Contact(opened, crossed)


@dataclass(frozen=True, eq=False)
class OneSided:
    """Expressions of one half of the face at 60 %, by the shapes of that half alone, corrected.

    Attributes
    ----------
    own, other : float
        Largest change of a shape of the half that acts, and of the half that rests.
    mirror : float
        Largest difference between the correction of a performance and that of its mirror image,
        without noise.
    """

    own: float
    other: float
    mirror: float


def one_sided(face: Face) -> OneSided:
    """Show the left, then the right half of each expression for half a second."""
    names = np.array(face.mesh.shape_names)
    halves_of = [np.isin(names, listed) for listed in (face.parts.left, face.parts.right)]
    hold_ = np.minimum(1.0, np.minimum(np.arange(60), 59 - np.arange(60)) / 15)[:, None]
    own, other, changes = [], [], []
    for acts, rests in (halves_of, halves_of[::-1]):
        shown = [0.6 * hold_ * np.where(acts, pose, 0.0) for pose in face.poses]
        played = face.play(np.concatenate(shown))
        change = np.abs(played.corrected - played.solved).reshape(len(shown), 60, -1)
        own.append(float(change[:, :, acts].max()))
        other.append(float(change[:, :, rests].max()))
        clean = face.play(np.concatenate(shown), noise=0.0)
        changes.append(clean.corrected - clean.solved)
    swap = {left: _twin(left) for left in face.parts.left}
    swap |= {right: left for left, right in swap.items()}
    order = [list(names).index(swap.get(n, n)) for n in names]
    difference = np.abs(changes[0][:, order] - changes[1])
    return OneSided(max(own), max(other), float(difference.max()))


def _twin(name: str) -> str:
    for left, right in (("Left", "Right"), ("left", "right")):
        if left in name:
            return name.replace(left, right)
    return f"{name[:-2]}_R" if name.endswith("_L") else name


def roughness(weights: FloatArray) -> float:
    return float(np.sqrt((np.diff(weights, 2, axis=0) ** 2).mean()))
