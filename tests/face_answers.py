"""What the expression layer of a face answers: to single poses, weak, one-sided, in contact."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from faces import Face

from usdface.arrays import FloatArray
from usdface.correction.apertures import apertures_of
from usdface.correction.contact import limit_correction
from usdface.face.curve_mapping import rename_weights
from usdface.io.takes.files import read_take
from usdface.rule_design.movements import single_movements

__all__ = [
    "AMOUNTS",
    "contact",
    "loudest_alone",
    "one_sided",
    "others_heard",
    "range_of_motion",
    "sweep",
    "weak_expressions",
]

AMOUNTS = (0.4, 0.55, 0.7)


def range_of_motion(face: Face, shared: Path) -> tuple[FloatArray, float]:
    """Return recorded weights (F, S) that mean no emotion, and their rate [Hz]."""
    recorded, _ = read_take(shared / "livelinkface" / "alex_rom_3.csv")
    renamed, _ = rename_weights(recorded, face.mesh.shape_names)
    return np.clip(renamed.weights, 0, 1), recorded.rate


def loudest_alone(face: Face) -> dict[str, dict[str, float]]:
    """Return which emotions above 0.1 each blend shape alone, or with its twin, is taken for."""
    names = face.mesh.shape_names
    moves = single_movements(names)
    detected = {}
    for row, outputs in zip(moves, face.hear(moves), strict=True):
        loud = {e.name: float(o) for e, o in zip(face.expressions, outputs, strict=True) if o > 0.1}
        if loud:
            detected[" + ".join(n for n, w in zip(names, row, strict=True) if w)] = loud
    return detected


def others_heard(face: Face) -> FloatArray:
    """Return the loudest other emotion at each expression with one more movement: (N,)."""
    moves = single_movements(face.mesh.shape_names)
    found = []
    for i, pose in enumerate(face.poses):
        detected = face.hear(np.clip(pose + moves, 0.0, 1.0))
        found.append(np.delete(detected, i, axis=1).max(axis=1))
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
    detected = face.play(np.concatenate([level[:, None] * pose for pose in face.poses])).emotions
    answer = {}
    for i, expression in enumerate(face.expressions):
        part = detected[i * len(level) : (i + 1) * len(level)]
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
    `usdface.correction.apertures`.
    """
    names = face.mesh.shape_names
    closing = [
        [float("blink" in n.lower() or n.endswith("closure")) for n in names],
        [0.5 * ("press" in n.lower()) for n in names],
        [0.0] * len(names),
    ]
    solved = np.repeat(np.array(closing), len(face.poses), axis=0)
    wanted = np.maximum(solved, np.tile(face.poses, (len(closing), 1)))
    apertures = apertures_of(face.bound, names, face.poses)
    held, _, _ = limit_correction(solved, wanted, apertures)
    before = apertures.at(solved)
    shut = before < apertures.touch + apertures.tolerance
    opened, crossed = {}, {}
    for seam in ("lips", "lids"):
        own = shut & np.array([name.endswith(seam) for name in apertures.contact])
        after = [apertures.at(weights) for weights in (wanted, held)]
        most = [
            1000 * float((gap - np.maximum(before, apertures.touch))[own].max()) for gap in after
        ]
        deep = [
            1000 * float((np.minimum(before, apertures.floor) - gap)[own].max()) for gap in after
        ]
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
    halves_of = [
        np.isin(names, listed) for listed in (face.bound.layout.left, face.bound.layout.right)
    ]
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
    swap = {left: _twin(left) for left in face.bound.layout.left}
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
