"""The expression layer on whole takes: `python benchmarks/expression_takes.py`.

Held poses, movements that mean nothing, half-shown expressions under them, and plain expressions by
another performer with markers that are misplaced, hidden or wrong. Everything goes through the real
solve with 0.3 mm of marker noise. The layer was built on what `--part building` shows: the range
of motion, FACS variants (`fuzzy_variants.py`) and the performers of `BUILDING`. `--part end`
is held out: the performers of `END` and MakeHuman's published expressions; docs/measurements.md
says how often they have been scored. See README.md.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from face_answers import range_of_motion  # noqa: E402
from faces import NOISE, RATE, Face, Played, make_face  # noqa: E402
from fuzzy_variants import STRENGTH, UNITS, VARIANTS, sides  # noqa: E402
from makehuman_face import landmarks_on, posable_face, published_expressions  # noqa: E402

from benchmarks.solve.faces import Face as Performer  # noqa: E402
from benchmarks.solve.faces import bent  # noqa: E402
from usdface.arrays import FloatArray, IntArray  # noqa: E402
from usdface.correction import expression_classifier  # noqa: E402
from usdface.correction.expression_classifier import ExpressionClassifier  # noqa: E402
from usdface.face.face_motion import face_motion  # noqa: E402
from usdface.face.marker_surface import MarkerSurface  # noqa: E402
from usdface.geometry.triangulation import triangulated  # noqa: E402
from usdface.retarget.bound_points import BoundPoints  # noqa: E402
from usdface.retarget.solve_take import Solution, solve_take  # noqa: E402
from usdface.rule_design.movements import single_movements  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

RIGS = ("ict68", "ict41", "makehuman68", "makehuman41", "example", "example68")
# Seeds of performers: identity modes of the ICT model, weighted by so much, or a bend of so much.
BUILDING, END = (1, 2), (11, 12, 13)
MODES, BEND = 3.0, 0.005
MISPLACED = 0.004
# Places of each triangle, for misplaced markers.
SAMPLES = 20
# Least output that counts as detected; the threshold of `expressions.py`.
DETECTED = 0.35
PUBLISHED = {
    "anger": ("anger01", "threaten01"),
    "disgust": ("disgust01",),
    "fear": ("fear01",),
    "joy": ("smile01", "smile02", "laugh01"),
    "sadness": ("sad01", "cry01"),
    "surprise": ("surprise01",),
}  # fmt: skip
REST = round(RATE)


def recorded(
    face: Face, positions: FloatArray, rate: float = RATE, seed: int = 0
) -> tuple[MarkerTake, Solution]:
    """Record markers (F, M, 3) after a second at rest with noise; solve them."""
    rest = np.repeat(positions[:1], REST, axis=0)
    positions = np.concatenate([rest, positions])
    positions = positions + NOISE * np.random.default_rng(seed).standard_normal(positions.shape)
    take = MarkerTake(face.setup.binding.markers, np.arange(len(positions)) / rate, positions, rate)
    points = face.setup.binding.points
    mesh = face.mesh
    solution, _ = solve_take(
        take,
        BoundPoints.linear(mesh.points[points], mesh.offsets_at(points), mesh.shape_names),
        face.setup,
        surface=MarkerSurface(mesh, points),
    )
    return take, solution


def performed(face: Face, positions: FloatArray, rate: float = RATE, seed: int = 0) -> Played:
    """Record markers (F, M, 3), solve, hear and correct them."""
    take, solution = recorded(face, positions, rate, seed)
    return face.judge(take, solution.weights, solution, REST)


@dataclass(frozen=True, eq=False)
class Actor:
    """Another person's face: neutral markers (M, 3) and their offsets (S, M, 3) [m]."""

    neutral: FloatArray
    offsets: FloatArray

    def show(self, weights: FloatArray) -> FloatArray:
        return self.neutral + np.einsum("fs,smk->fmk", weights, self.offsets, optimize=True)


def actor(face: Face, kind: str, seed: int | None, misplaced: float = 0.0) -> Actor:
    """Return an actor; without a seed the character itself. Places are off by `misplaced` [m]."""
    mesh = face.mesh
    if misplaced:
        corners, shares = moved_places(face, misplaced, 0 if seed is None else seed)
    else:
        corners = np.array(face.setup.binding.points)[:, None]
        shares = np.ones(corners.shape)
    if seed is not None and kind.startswith("ict"):
        rng = np.random.default_rng(seed)
        offsets = identities()
        weights = MODES * rng.uniform(-1, 1, size=len(offsets))
        shifted = mesh.points + np.tensordot(weights, offsets[:, : len(mesh.points)], axes=1)
        mesh = replace(mesh, points=shifted, normals=None)
    elif seed is not None:
        points = np.array(face.setup.binding.points)
        other = Performer(mesh, points, np.zeros((1, len(mesh.shapes))), RATE)
        mesh = bent(other, seed, BEND).mesh
    offsets = mesh.offsets_at(corners.ravel()).reshape(len(mesh.shapes), *corners.shape, 3)
    return Actor(
        np.einsum("mc,mck->mk", shares, mesh.points[corners]),
        np.einsum("mc,smck->smk", shares, offsets),
    )


@cache
def identities() -> FloatArray:
    packed = np.load(SHARED / "ict_identities" / "identity_offsets.npz")
    return 0.01 * np.array([packed[name] for name in packed.files], dtype=np.float64)


def moved_places(face: Face, distance: float, seed: int) -> tuple[IntArray, FloatArray]:
    """Return for each marker a place of the skin about so far away [m], in a direction by chance.

    The skin there faces the same way: no marker is in the mouth. Each place is three vertices and
    their shares: (M, 3), (M, 3). Vertices of some meshes are further apart than `distance`.
    """
    rng = np.random.default_rng(100 + seed)
    mesh = face.mesh
    reach = np.linalg.norm(mesh.offsets_at(np.arange(len(mesh.points))), axis=2).max(axis=0)
    corners, _ = triangulated(mesh.face_counts, mesh.face_indices, mesh.points)
    triangles = mesh.face_indices[corners]
    worn = np.isin(triangles, face.setup.binding.points).any(axis=1)
    triangles = triangles[(reach[triangles] > 1e-4).all(axis=1) | worn]
    shares = rng.dirichlet((1.0, 1.0, 1.0), size=(SAMPLES, len(triangles)))
    samples = np.einsum("ntc,tck->ntk", shares, mesh.points[triangles]).reshape(-1, 3)
    tree = cKDTree(samples)
    a, b, c = np.moveaxis(mesh.points[triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    moved = []
    for point in face.setup.binding.points:
        own = normals[(triangles == point).any(axis=1)].sum(axis=0)
        near = np.array(tree.query_ball_point(mesh.points[point], 1.5 * distance), dtype=np.int64)
        near = near[normals[near % len(triangles)] @ own > 0.0]
        error = np.abs(np.linalg.norm(samples[near] - mesh.points[point], axis=1) - distance)
        moved.append(int(rng.choice(near[np.argsort(error)[: max(6, len(near) // 20)]])))
    chosen = np.array(moved)
    return triangles[chosen % len(triangles)], shares.reshape(-1, 3)[chosen]


def ease(frames: int) -> FloatArray:
    x = np.linspace(0, 1, frames)
    return x**2 * (3 - 2 * x)


def course(seconds: float, gap: float = 0.8, rise: float = 0.35) -> FloatArray:
    up = ease(round(rise * RATE))
    rest = np.zeros(round(gap * RATE))
    return np.concatenate([rest, up, np.ones(round(seconds * RATE)), up[::-1], rest])


def held(kinds: tuple[str, ...]) -> Table:
    """Hold each expression at 50 % for 0.5 to 5 s."""
    table = made("Expressions at half, held for 0.5, 2 and 5 s", "face,varies by,goes back by")
    for kind in kinds:
        face = make_face(kind, SHARED)
        worst, back = 0.0, 0.0
        for seconds in (0.5, 2.0, 5.0):
            curve = course(seconds)
            shown = np.concatenate([0.5 * curve[:, None] * pose for pose in face.poses])
            played = performed(face, actor(face, kind, None).show(shown))
            change = (played.corrected - played.solved).reshape(len(face.poses), len(curve), -1)
            inside = np.flatnonzero(curve >= 1 - 1e-9)
            worst = max(worst, float(np.ptp(change[:, inside[6:-6]], axis=1).max()))
            for part, sign in ((change[:, : inside[0]], 1), (change[:, inside[-1] :], -1)):
                course_ = sign * part
                back = max(back, float((np.maximum.accumulate(course_, axis=1) - course_).max()))
        table.add_row(kind, f"{worst:.3f}", f"{back:.3f}")
    return table


def speech(face: Face, seconds: float, seed: int = 0) -> FloatArray:
    """Return weights (F, S) of a mouth that speaks, or of the rig's nearest: syllables at 4 Hz."""
    rng = np.random.default_rng(seed)
    names = face.mesh.shape_names
    size = {
        **{"jawOpen": 0.35, "mouthFunnel": 0.5, "mouthPucker": 0.5, "mouthClose": 0.2},
        **{"mouthStretch": 0.3, "mouthLowerDown": 0.4, "mouthUpperUp": 0.3, "mouthPress": 0.3},
        **{"mouthRollLower": 0.3, "mouth-open": 0.35, "mouth-protusion": 0.5},
        **{"mouth-pursing": 0.5, "mouth-part-later": 0.4, "mouth-retraction": 0.3},
    }
    knots = rng.uniform(0, 1, size=(round(4 * seconds) + 2, len(size)))
    knots *= rng.uniform(size=knots.shape) > 0.5
    times = np.linspace(0, len(knots) - 1, round(seconds * RATE))
    weights = np.zeros((len(times), len(names)))
    for column, (shape, most) in enumerate(size.items()):
        curve = most * np.interp(times, np.arange(len(knots)), knots[:, column])
        for i, name in enumerate(names):
            if name == shape or (name.startswith(shape) and name[len(shape) :].strip("_") in SIDES):
                weights[:, i] = curve
    return weights


SIDES = ("L", "R", "Left", "Right")


def repeated(face: Face, seconds: float, rate: float, *shapes: tuple[str, float]) -> FloatArray:
    """Return weights (F, S) of a movement that repeats: a pucker, chewing."""
    times = np.arange(round(seconds * RATE)) / RATE
    wave = 0.5 - 0.5 * np.cos(2 * np.pi * rate * times)
    weights = np.zeros((len(times), len(face.mesh.shapes)))
    for shape, most in shapes:
        for i, name in enumerate(face.mesh.shape_names):
            if name == shape or (name.startswith(shape) and name[len(shape) :].strip("_") in SIDES):
                weights[:, i] = most * wave
    return weights


def nothing(kinds: tuple[str, ...]) -> tuple[Table, Table]:
    """Play what means no emotion, then half-shown expressions under it."""
    table = made(
        "Movements that mean nothing: frames changed by more than 0.3 and 0.1, loudest output",
        "face,range of motion,speech,pucker,chewing,single shapes",
    )
    under = made(
        "Expressions at half under speech and chewing: right strongest, pose reached by",
        "face,speech,chewing",
    )
    for kind in kinds:
        face = make_face(kind, SHARED)
        cells = []
        alone = single_movements(face.mesh.shape_names)
        curve = course(0.5, gap=0.4, rise=0.25)
        shapes = np.concatenate([curve[:, None] * row for row in alone])
        jaw = "jawOpen" if "jawOpen" in face.mesh.shape_names else "mouth-open"
        purse = "mouthPucker" if jaw == "jawOpen" else "mouth-pursing"
        takes = {
            "speech": speech(face, 20.0),
            "pucker": repeated(face, 6.0, 0.5, (purse, 0.9)),
            "chewing": repeated(face, 6.0, 1.2, (jaw, 0.3), ("mouthPress", 0.3), ("jawLeft", 0.3)),
        }
        if "makehuman" in kind:
            cells.append("")
        else:
            cells.append(changed(face.play(*range_of_motion(face, SHARED))))
        self = actor(face, kind, None)
        cells += [changed(performed(face, self.show(w))) for w in takes.values()]
        cells.append(changed(performed(face, self.show(shapes))))
        table.add_row(kind, *cells)
        found = []
        for weights in (takes["speech"], takes["chewing"]):
            right, reached = [], []
            for i, pose in enumerate(face.poses):
                curve = course(2.0)
                shown = np.clip(0.5 * curve[:, None] * pose + 0.6 * weights[: len(curve)], 0, 1)
                played = performed(face, self.show(shown))
                inside = curve >= 1 - 1e-9
                right.append((played.emotions[inside].argmax(axis=1) == i).mean())
                moved = (played.corrected - played.solved)[inside][:, pose > 0].mean(axis=0)
                reached.append(moved.max() / pose.max())
            found.append(f"{100 * np.mean(right):.0f} %, {np.mean(reached):.2f}")
        under.add_row(kind, *found)
    return table, under


def changed(played: Played) -> str:
    change = np.abs(played.corrected - played.solved).max(axis=1)
    shares = f"{100 * (change > 0.3).mean():.1f} %, {100 * (change > 0.1).mean():.1f} %"
    return f"{shares}, {played.emotions.max():.2f}"


def plain(kinds: tuple[str, ...], seeds: tuple[int, ...]) -> Table:
    """Raise each expression on another person with misplaced markers."""
    columns = "face,performer,strongest from 30 % on,least at 70 %,mean at 70 %,weak"
    table = made("Plain expressions: bent or other faces, places off by 4 mm", columns)
    for kind in kinds:
        face = make_face(kind, SHARED)
        who: list[tuple[str, int | None, float]] = [("itself", None, 0.0)]
        who += [(f"itself, 4 mm off ({s})", None, MISPLACED) for s in seeds[:1]]
        who += [(f"another ({s})", s, 0.0) for s in seeds]
        who += [(f"another, 4 mm off ({s})", s, MISPLACED) for s in seeds]
        for title, seed, off in who:
            found = raised(face, actor(face, kind, seed, off))
            table.add_row(kind, title, *found)
    return table


def raised(face: Face, other: Actor) -> list[str]:
    rise = np.linspace(0, 1, 121)
    curve = np.concatenate([np.zeros(30), rise, np.ones(20), rise[::-1], np.zeros(30)])
    weights = np.concatenate([curve[:, None] * pose for pose in face.poses])
    emotions = performed(face, other.show(weights)).emotions.reshape(
        len(face.poses), len(curve), -1
    )
    from_30, at_70 = slice(30 + 36, 30 + 141), slice(30 + 82, 30 + 87)
    right = [(emotions[i, from_30].argmax(axis=1) == i).mean() for i in range(len(face.poses))]
    size = np.array([emotions[i, at_70, i].mean() for i in range(len(face.poses))])
    names = [e.name for e in face.expressions]
    weak = ", ".join(f"{n} {s:.2f}" for n, s in zip(names, size, strict=True) if s < 0.5)
    return [f"{100 * np.mean(right):.1f} %", f"{size.min():.2f}", f"{size.mean():.2f}", weak]


def single_conditions(kinds: tuple[str, ...]) -> Table:
    """Hide each marker that a rule reads, or let it not move, one after the other."""
    table = made(
        "Expressions at 80 % with one condition hidden, and one that is contrary: outputs",
        "face,least hidden,least contrary,contrary below 0.5",
    )
    for kind in kinds:
        face = make_face(kind, SHARED)
        fuzzy = face.system.fuzzy
        least, wrong, missed = 1.0, 1.0, []
        from usdface.correction.feature_extraction import sided_features
        from usdface.fuzzy.inference import evaluate
        from usdface.takes import WeightsTake

        weights = 0.8 * face.poses
        take = WeightsTake(face.mesh.shape_names, np.arange(len(weights)) / RATE, weights, RATE)
        inputs = sided_features(
            face.system, face.bound, take, weights=take, solution=None, sides=("both",)
        ).sides["both"]
        columns = {v.name: i for i, v in enumerate(fuzzy.inputs)}
        for row, expression in enumerate(face.expressions):
            rules = [r for r in fuzzy.rules if r.consequents[0][0] == expression.name]
            for name in {p.variable for r in rules for p in r.propositions if not p.hedges}:
                for value in (np.nan, -0.5 * inputs[row, columns[name]]):
                    given = inputs[row : row + 1].copy()
                    given[0, columns[name]] = value
                    output = float(evaluate(fuzzy, given).outputs[0, row])
                    if np.isnan(value):
                        least = min(least, output)
                    else:
                        wrong = min(wrong, output)
                        missed += [f"{expression.name} {name}"] if output < 0.5 else []
        table.add_row(kind, f"{least:.2f}", f"{wrong:.2f}", "; ".join(missed))
    return table


def variants() -> Table:
    """Hear the prototypes and major variants of FACS, on the character itself."""
    table = made("FACS variants on the ICT face", "face,right,missed,wrong,which")
    for kind in ("ict68", "ict41"):
        face = make_face(kind, SHARED)
        shown = [(e, t, performed(face, positions).emotions) for e, t, positions in facs(face)]
        table.add_row(kind, *detection_counts(face, shown))
    return table


def facs(face: Face) -> Iterator[tuple[str, str, FloatArray]]:
    index = {name: i for i, name in enumerate(face.mesh.shape_names)}
    for emotion, shown in VARIANTS.items():
        for units in shown:
            pose = np.zeros(len(index))
            for unit in units:
                for name in (n + side for n in UNITS[unit] for side in sides(n)):
                    pose[index[name]] += STRENGTH.get(unit, 0.8)
            weights = np.clip(pose, 0, 1)[None] * course(0.6)[:, None]
            yield emotion, "+".join(map(str, units)), actor(face, "", None).show(weights)


def published() -> Table:
    """Hear MakeHuman's published expressions, posed by joints, on its own shapes and on ICT's.

    Without MakeHuman in the table of face motion, and with it.
    """
    columns = "face,without,right,missed,wrong,which,speech"
    table = made("MakeHuman's published expressions", columns)
    body = posable_face(SHARED)
    known = published_expressions(SHARED)
    for kind in ("makehuman68", "makehuman41", "ict68", "ict41"):
        face = make_face(kind, SHARED)
        places = face.setup.binding.points
        if kind.startswith("ict"):
            places = landmarks_on(body, SHARED, places)
        marked = replace(body, points=body.points[places], weights=body.weights[places])
        curve = course(0.6)
        levels, inverse = np.unique(curve, return_inverse=True)
        takes = {}
        for name in ("vocalize01", *(n for names in PUBLISHED.values() for n in names)):
            steps = [marked.posed({u: a * w for u, w in known[name].items()}) for a in levels]
            takes[name] = recorded(face, np.array(steps)[inverse])
        for without in ("MakeHuman", ""):
            rigs = tuple(r for r in face_motion().rigs if not without or without not in r)
            unknown = partial(ExpressionClassifier, rigs=rigs)
            with patch.object(expression_classifier, "ExpressionClassifier", unknown):
                played = {
                    name: face.judge(take, solution.weights, solution, REST).emotions
                    for name, (take, solution) in takes.items()
                }
            shown = [(e, name, played[name]) for e, names in PUBLISHED.items() for name in names]
            spoken = played["vocalize01"].max()
            table.add_row(kind, without or "-", *detection_counts(face, shown), f"{spoken:.2f}")
    return table


def detection_counts(face: Face, shown: list[tuple[str, str, FloatArray]]) -> list[str]:
    """Return of how many performances the outputs (F, E) are right, missed and wrong."""
    names = [e.name for e in face.expressions]
    counts = {"right": 0, "missed": 0, "wrong": 0}
    failures = []
    inside = course(0.6) >= 1 - 1e-9
    for emotion, title, emotions in shown:
        outputs = emotions[inside].mean(axis=0)
        loudest = int(outputs.argmax())
        if outputs[loudest] < DETECTED:
            counts["missed"] += 1
            failures.append(f"{emotion} {title}: own {outputs[names.index(emotion)]:.2f}")
        elif names[loudest] == emotion:
            counts["right"] += 1
        else:
            counts["wrong"] += 1
            failures.append(f"{emotion} {title}: {names[loudest]} {outputs[loudest]:.2f}")
    return [*map(str, counts.values()), "; ".join(failures)]


def made(title: str, columns: str) -> Table:
    table = Table(title=title)
    for column in columns.split(","):
        table.add_column(column, justify="left" if column in ("face", "performer") else "right")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=("building", "end"), default="building")
    parser.add_argument("--faces", nargs="+", choices=RIGS, default=RIGS)
    given = parser.parse_args()
    kinds = tuple(given.faces)
    console = Console(width=None if sys.stdout.isatty() else 150)
    if given.part == "end":
        console.print(plain(kinds, END))
        console.print(published())
        return
    console.print(held(kinds))
    for table in nothing(kinds):
        console.print(table)
    console.print(plain(kinds, BUILDING))
    console.print(single_conditions(kinds))
    console.print(variants())


if __name__ == "__main__":
    main()
