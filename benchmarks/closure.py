"""Blinks, lids and lips: `python benchmarks/closure.py`.

Labelled worlds: recorded weights (Live Link Face, with real blinks) drive a person of the ICT model
who is not the character; markers on that face, with noise and a moving head, are the take, which is
retargeted to the ICT face. An eye counts as closed where the recorded weights, looks and squints
included, leave less than 15 % of the opening between its lids and its blink is above 0.8; as open
above 35 %, and shut wrongly while the layer closes it there. The first half of the recording was
looked at while the closure layer was built; `--held-out` scores the second half, with another
person. `--film`: the same through one camera whose focal length is given, 0.7 m away, with 0.35 px
of noise. See README.md.
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.ndimage import grey_closing, grey_opening

from usdface import assemble_shot, read_bind, read_rig
from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.lip_contact import lip_apertures_of
from usdface.closure.lip_signal import lip_distances
from usdface.closure.rims import rim_pairs
from usdface.face.bound_face import BoundFace
from usdface.face.curve_mapping import rename_weights
from usdface.face.layout import find_layout
from usdface.io.takes.files import read_take
from usdface.options import ProcessOptions
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.rigs import Mesh, Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup, unbound
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot, ShotResult
from usdface.takes import MarkerTake, WeightsTake

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from faces import make_face  # noqa: E402
from ict_face import ict_mesh, landmarks  # noqa: E402

from benchmarks.binding import head_mesh  # noqa: E402
from benchmarks.known_answer import moved  # noqa: E402

NEUTRAL = 30
CLOSED, BLINK, OPEN = 0.15, 0.8, 0.35
# Markers of the lips that are further apart than at rest by less touch [mm].
TOUCH = 0.5
# Of the closure layer's course: the eye looks shut.
SHUT = 0.9
# Most that a blink may be in a take without blinks.
HALF = 0.6
# Share of the opening that a pulse of the lids takes which is no noise.
PULSE = 0.15
IMAGE, LENS, DISTANCE, BLUR = (1280, 960), 1100.0, 0.7, 0.35  # px, px, m, px
# Within this many frames a closing belongs to a label.
REACH = 3
# Modes of the ICT model and their weights: the persons while building, and held out.
PERSONS = (
    {"identity020": 1.5, "identity022": -1.0, "identity025": 2.0},
    {"identity021": 1.2, "identity023": -2.0, "identity027": 1.5},
)


@dataclass(frozen=True)
class World:
    name: str
    points: np.ndarray
    noise: float = 3e-4
    strength: float = 1.0
    misplaced: float = 0.0
    pulses: str = "recorded"
    film: bool = False


def bound_by_hand(head: str) -> dict[str, int]:
    bind = json.loads((ROOT / "tests" / "data" / f"animface_{head}_bind.json").read_text())
    return {name: place["point"] for name, place in bind["markers"].items()}


def layouts() -> dict[str, np.ndarray]:
    return {
        "41 markers": np.array(list(bound_by_hand("ict").values())),
        "68 landmarks": landmarks(SHARED),
    }


def nose_tip(count: int) -> str:
    """Return the marker on the tip of the nose: of the landmarks the 31st."""
    return f"m{30 if count == 68 else list(bound_by_hand('ict')).index('NoseHead')}"


def recorded(mesh: Mesh, half: int) -> WeightsTake:
    take, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    weights = rename_weights(take, mesh.shape_names)[0].weights
    middle = len(weights) // 2
    own = weights[:middle] if half == 0 else weights[middle:]
    own = np.concatenate([np.zeros((NEUTRAL, own.shape[1])), own])
    return WeightsTake(mesh.shape_names, np.arange(len(own)) / take.rate, own, take.rate)


def without_blinks(take: WeightsTake, rng: np.random.Generator) -> WeightsTake:
    """Take the blinks out, and put in fast squints and smiles that raise the cheeks."""
    weights = take.weights.copy()
    for side in "LR":
        column = take.names.index(f"eyeBlink_{side}")
        weights[:, column] = np.minimum(grey_opening(weights[:, column], 21), HALF)
    for start in rng.choice(np.arange(60, len(weights) - 60, 40), 25, replace=False):
        rise = 0.5 - 0.5 * np.cos(np.linspace(0, 2 * np.pi, int(rng.integers(15, 36))))
        kinds = (("eyeSquint",), ("cheekSquint", "mouthSmile"), ("eyeLookDown",))
        for kind in kinds[int(rng.integers(3))]:
            for side in "LR":
                column = take.names.index(f"{kind}_{side}")
                part = weights[start : start + len(rise), column]
                part[:] = np.maximum(part, rng.uniform(0.5, 0.9) * rise)
    return replace(take, weights=weights)


def with_winks(take: WeightsTake, rng: np.random.Generator) -> WeightsTake:
    """Add winks of one eye, from as fast as a blink to a second, with a raised cheek."""
    weights = take.weights.copy()
    for start in rng.choice(np.arange(60, len(weights) - 60, 60), 16, replace=False):
        down, shut, up = (int(rng.integers(*span)) for span in ((3, 6), (2, 18), (4, 9)))
        rise = np.concatenate([np.arange(down) / down, np.ones(shut), np.linspace(1, 0, up)])
        own, other = ("L", "R") if rng.integers(2) else ("R", "L")
        shares = {
            f"eyeBlink_{own}": (0.85, 1.0),
            f"eyeSquint_{own}": (0.2, 0.6),
            f"cheekSquint_{own}": (0.2, 0.6),
            f"mouthSmile_{own}": (0.1, 0.5),
            f"eyeBlink_{other}": (0.0, 0.2),
            f"eyeSquint_{other}": (0.0, 0.3),
        }
        for name, span in shares.items():
            part = weights[start : start + len(rise), take.names.index(name)]
            part[:] = np.maximum(part, rng.uniform(*span) * rise**2 * (3 - 2 * rise))
    return replace(take, weights=weights)


def performed(mesh: Mesh, take: WeightsTake, world: World, half: int, seed: int) -> MarkerTake:
    packed = np.load(SHARED / "ict_identities" / "identity_offsets.npz")
    person = mesh.points + 0.01 * sum(w * packed[name] for name, w in PERSONS[half].items())
    rng = np.random.default_rng(seed)
    offsets = mesh.offsets_at(world.points)
    strength = np.full(len(offsets), world.strength)
    places = person[world.points]
    moves = np.einsum("fs,smd->fmd", take.weights * strength, offsets)
    face = moved(take.times, places + moves)
    names = tuple(f"m{k}" for k in range(len(world.points)))
    if world.film:
        before = face - face[0].mean(axis=0) - [0.0, 0.0, DISTANCE]
        image = PinholeCamera(LENS, 0.5 * np.array(IMAGE) * [1.0, -1.0]).image(before)
        image += BLUR * rng.standard_normal(image.shape)
        return MarkerTake(names, take.times, image, take.rate, image_size=IMAGE, focal_length=LENS)
    face += world.noise * rng.standard_normal(face.shape)
    return MarkerTake(names, take.times, face, take.rate)


PULSES = {"recorded": lambda take, _: take, "none": without_blinks, "winks": with_winks}


def bound_points(mesh: Mesh, world: World, seed: int) -> np.ndarray:
    """Return the vertices that the markers are bound to: the right ones, or some way off."""
    if not world.misplaced:
        return world.points
    rng = np.random.default_rng(seed)
    result = []
    for vertex in world.points:
        away = np.linalg.norm(mesh.points - mesh.points[vertex], axis=1)
        near = np.flatnonzero((away > 0.7 * world.misplaced) & (away < 1.3 * world.misplaced))
        near = near[near < 9409]  # the skin of the face
        result.append(int(rng.choice(near)) if len(near) else int(vertex))
    return np.array(result)


def run(mesh: Mesh, take: WeightsTake, world: World, half: int) -> ShotResult:
    markers, tip = performed(mesh, take, world, half, 7), nose_tip(len(world.points))
    return on_face(mesh, markers, bound_points(mesh, world, 11), tip)


def on_face(mesh: Mesh, markers: MarkerTake, places: np.ndarray, tip: str) -> ShotResult:
    """Retarget markers that are bound to `places` on a face; `tip` is that of the nose."""
    binding = Binding(markers.names, places, mesh.name)
    setup = RetargetSetup(binding, neutral=(0, NEUTRAL - 1), nose_tip=tip)
    shot = Shot(Rig("Face", (mesh,)), markers, setup)
    return retarget(shot, options=ProcessOptions(express=False))


def segments(where: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


@dataclass
class Score:
    closed: int
    heard: int
    partial: int
    false: int
    wrong: float
    missed_frames: list[int]
    false_frames: list[int]


def score(truth: FloatArray, blink: FloatArray, course: FloatArray) -> Score:
    """Compare a person's eye, its share of the opening (F,), with the closure layer's (F,)."""
    labels = segments((truth <= CLOSED) & (blink >= BLINK))
    ours = segments(course >= 0.95)
    missed = [a for a, b in labels if course[max(a - REACH, 0) : b + REACH].max() < 0.95]
    pulse = grey_closing(truth, 18) - truth
    near = [slice(max(a - REACH, 0), b + REACH) for a, b in ours]
    wide = [where for where in near if truth[where].min() > OPEN]
    partial = [where.start for where in wide if pulse[where].max() >= PULSE]
    false = [where.start for where in wide if pulse[where].max() < PULSE]
    heard = len(labels) - len(missed)
    wrong = float(((course > SHUT) & (truth > OPEN)).mean())
    return Score(len(labels), heard, len(partial), len(false), wrong, missed, false)


def crossing_by_pose(face: BoundFace, weights: FloatArray, frames: np.ndarray) -> float:
    """Return by how much lids cross [mm], with rims that are paired in each pose anew."""
    mesh, deepest = face.mesh, 0.0
    lids = face.layout.lids
    middle = (mesh.points[lids, 0].min() + mesh.points[lids, 0].max()) / 2
    moves = evaluator_of(mesh.shapes, np.arange(len(mesh.points)))[0]
    for frame in frames.tolist():
        posed = mesh.points + moves.displacements(weights[[frame]]).reshape(-1, 3)
        left = mesh.points[lids[:, 0], 0] > middle
        for own in (lids[left], lids[~left]):
            opening = np.linalg.norm(mesh.points[own[:, 0]] - mesh.points[own[:, 1]], axis=1).mean()
            pairs = rim_pairs(mesh, own, posed, 0.25 * opening)
            if pairs.points.shape[0]:
                vertices = pairs.vertices
                open_gap = pairs.apertures(vertices, mesh.points[vertices].reshape(-1))
                aperture = pairs.apertures(vertices, posed[vertices].reshape(-1))[
                    open_gap > 0.5 * opening
                ]
                deepest = max(deepest, -1000 * float(aperture.min(initial=0.0)))
    return deepest


def real_takes(mesh: Mesh) -> None:
    """List every closing of the real takes, and of the example."""
    rig = Rig("Face", (mesh,))
    shots = {}
    for head in ("ict", "makehuman", "example"):
        bind, _ = read_bind(ROOT / "tests" / "data" / f"animface_{head}_bind.json")
        other = rig if head == "ict" else Rig("Face", (head_mesh(head),))
        for name in ("Jaw", "Eyebrows"):
            take, _ = read_take(SHARED / "animface" / f"{name}.c3d")
            shots[f"{name} on {head}"] = assemble_shot(other, take, setup=bind)[0]
            shots[f"{name} on {head}, places proposed"] = assemble_shot(other, take)[0]
    take, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    shots["Live Link Face"] = Shot(rig, take, unbound(take))
    head, _ = read_rig(ROOT / "examples" / "head.usdc")
    take, _ = read_take(ROOT / "examples" / "performance.trc")
    setup, _ = read_bind(ROOT / "examples" / "bind.json")
    shots["example"] = assemble_shot(head, take, setup=setup)[0]
    for name, shot in shots.items():
        result = retarget(shot)
        layout = shot.layout if len(shot.layout.lids) else find_layout(shot.mesh, (), 0.0)
        face = replace(shot.face, layout=layout)
        apertures = lid_apertures_of(face, result.solved.names)
        before = result.solved.weights if result.corrected is None else result.corrected
        crossing = [
            max(0.0, -1000 * min(float(own.least(weights).min()) for own in apertures.values()))
            for weights in (before, result.closure.weights)
        ]
        closed = np.flatnonzero(result.closure.eyes.max(axis=1) > 0.9)
        sample = closed[:: max(len(closed) // 40, 1)]
        lips_over_time(face, result, before)
        columns = [result.solved.names.index(shape) for shape in shot.mesh.shape_names]
        deepest = crossing_by_pose(face, result.closure.weights[:, columns], sample)
        table = Table(
            title=f"{name}: lids cross by {crossing[0]:.2f} mm before, {crossing[1]:.2f} after; "
            f"{deepest:.2f} with pairs of each pose"
        )
        for column in (
            "closing",
            "eyes",
            "frames",
            "closed",
            "seen",
            "weights",
            "after",
            "aperture mm",
        ):
            table.add_column(column, justify="right")
        for each in result.closure.closings:
            table.add_row(
                each.closing.kind,
                " ".join("LR"[eye] for eye in each.closing.eyes),
                "{} to {}".format(*each.frames),
                str(each.peak),
                f"{each.closing.height:.2f}",
                " ".join(f"{weight:.2f}" for weight in each.before),
                " ".join(f"{weight:.2f}" for weight in each.after),
                " ".join(f"{1000 * aperture:.2f}" for aperture in each.apertures),
            )
        Console().print(table)


def lips_over_time(face: BoundFace, result: ShotResult, before: FloatArray) -> None:
    """Print how far the lips are open where the markers touch, and how fast they part."""
    apertures = lip_apertures_of(face, result.solved.names)
    if apertures is None or result.solution is None or result.closure is None:
        return
    apart = lip_distances(face, result.solved, result.solution, apertures.across, apertures.x)
    if apart is None:
        return
    was, now = (1000 * apertures.opened(weights) for weights in (before, result.closure.weights))
    seen = 1000 * apart.seen
    steps = [np.abs(np.diff(each, axis=0)).max(axis=1) for each in (was, now, seen)]
    excess = steps[1] - np.maximum(steps[0], steps[2])
    touch = seen.max(axis=1) < TOUCH
    wide = [int((each[touch].max(axis=1) > 1.0).sum()) for each in (was, now)]
    print(
        f"lips: markers as near as at rest in {touch.sum()} frames, open there by more than 1 mm "
        f"in {wide[0]} before, {wide[1]} after; largest change per frame {steps[0].max():.2f} mm "
        f"before, {steps[1].max():.2f} after, {steps[2].max():.2f} of the markers; faster than "
        f"both by {max(excess.max(), 0.0):.2f} mm at most, at frame {excess.argmax()}"
    )


def filmed_worlds() -> list[World]:
    return [
        World(f"{name}, {kind}", points, pulses=pulses, film=True)
        for kind, pulses in (("film", "recorded"), ("no blinks", "none"), ("winks", "winks"))
        for name, points in layouts().items()
    ]


def worlds() -> list[World]:
    places = layouts()
    found = [World(name, points) for name, points in places.items()]
    found += [World(f"{name}, 1 mm", points, noise=1e-3) for name, points in places.items()]
    found += [World(f"{n}, strength 0.6", p, strength=0.6) for n, p in places.items()]
    found += [World(f"{n}, 4 mm off", p, misplaced=0.004) for n, p in places.items()]
    found += [World(f"{n}, no blinks", p, pulses="none") for n, p in places.items()]
    return found + [World(f"{n}, winks", p, pulses="winks") for n, p in places.items()]


def scored(shown: WeightsTake, eyes: FloatArray) -> list[Score]:
    """Compare what an ICT face showed with the course of both eyes (F, 2)."""
    scores = []
    for column, own in enumerate(lid_apertures_of(ict_face(), shown.names).values()):
        truth = own.ends(shown.weights)[1] / own.ends(np.zeros((1, len(shown.names))))[1]
        scores.append(score(truth, shown.weights[:, own.closer], eyes[:, column]))
    return scores


@cache
def ict_face() -> BoundFace:
    return BoundFace(ict_mesh(SHARED), (), np.zeros(0, int)).with_layout(())


def counts(scores: list[Score]) -> list[str]:
    wrong = f"{100 * np.mean([s.wrong for s in scores]):.1f}"
    sums = [sum(getattr(s, name) for s in scores) for name in ("closed", "heard", "partial")]
    return [*map(str, sums), str(sum(s.false for s in scores)), wrong]


def own_head(take: WeightsTake, half: int, film: bool) -> Table:
    """Retarget all worlds to the ICT face itself."""
    table = Table(title=f"{'second' if half else 'first'} half of the recording")
    columns = "world,closed,found,partial,false,shut wrongly %,lids cross mm,before mm,open mm"
    for column in columns.split(","):
        table.add_column(column, justify="left" if column == "world" else "right")
    rng = np.random.default_rng(5 + half)
    apertures = lid_apertures_of(ict_face(), ict_mesh(SHARED).shape_names)
    for world in filmed_worlds() if film else worlds():
        shown = PULSES[world.pulses](take, rng)
        result = run(ict_mesh(SHARED), shown, world, half)
        scores = scored(shown, result.closure.eyes)
        final, solved = result.weights.weights, result.solved.weights
        ends = [own.ends(final) for own in apertures.values()]
        before = min(float(own.least(solved).min()) for own in apertures.values())
        shut = np.concatenate(
            [end[1][result.closure.eyes[:, k] > 0.999] for k, end in enumerate(ends)]
        )
        lips_that_touch(shown, solved, final)
        crossing = min(float(end[0].min()) for end in ends)
        table.add_row(
            world.name,
            *counts(scores),
            f"{max(-1000 * crossing, 0):.2f}",
            f"{max(-1000 * before, 0):.2f}",
            f"{1000 * np.median(shut):.2f}" if len(shut) else "",
        )
        print(world.name, [(s.missed_frames, s.false_frames) for s in scores])
    return table


def lips_that_touch(shown: WeightsTake, solved: FloatArray, final: FloatArray) -> None:
    """Print how far lips are open that touch on the performer, and parted ones come nearer."""
    lips = lip_apertures_of(ict_face(), shown.names)
    truth, before, after = (
        1000 * lips.opened(each).max(axis=1) for each in (shown.weights, solved, final)
    )
    touch, parted = truth < 0.5, truth > 2.0
    print(
        f"  lips touch in {touch.sum()} frames: open by more than 1 mm in "
        f"{(before[touch] > 1).sum()} before, {(after[touch] > 1).sum()} after; "
        f"open in {parted.sum()}: nearer by "
        f"{np.quantile((before - after)[parted], 0.99):.2f} mm (99 %)"
    )


def on_head(head: str, layout: str) -> tuple[np.ndarray, np.ndarray]:
    """Return which markers of a layout are on a head, and the vertices they are bound to."""
    if layout.startswith("41"):
        own = bound_by_hand(head)
        return np.arange(len(own)), np.array([own[name] for name in bound_by_hand("ict")])
    binding = make_face(f"{head}68", SHARED).setup.binding
    return np.array([int(name.split("_")[-1]) for name in binding.markers]), binding.points


def other_heads(take: WeightsTake, half: int) -> Table:
    """Retarget performers to heads that are not of their model."""
    table = Table(title=f"other heads, {'second' if half else 'first'} half")
    columns = "head,world,closed,found,partial,false,shut wrongly %"
    for column in columns.split(","):
        table.add_column(column, justify="left" if column in ("head", "world") else "right")
    for world in worlds():
        if world.misplaced:
            continue
        shown = PULSES[world.pulses](take, np.random.default_rng(5 + half))
        markers = performed(ict_mesh(SHARED), shown, world, half, 7)
        for head in ("makehuman", "example"):
            kept, places = on_head(head, world.name)
            names = tuple(markers.names[marker] for marker in kept)
            own = MarkerTake(names, markers.times, markers.positions[:, kept], markers.rate)
            tip = nose_tip(len(world.points))
            scores = scored(shown, on_face(head_mesh(head), own, places, tip).closure.eyes)
            table.add_row(head, world.name, *counts(scores))
            print(head, world.name, [(s.missed_frames, s.false_frames) for s in scores])
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--held-out", action="store_true", help="score what was not looked at")
    parser.add_argument("--takes", action="store_true", help="list the closings of the real takes")
    parser.add_argument("--heads", action="store_true", help="score MakeHuman and the example")
    parser.add_argument("--film", action="store_true", help="through one camera")
    arguments = parser.parse_args()
    if arguments.takes:
        real_takes(ict_mesh(SHARED))
        return
    half = int(arguments.held_out)
    take = recorded(ict_mesh(SHARED), half)
    heads = arguments.heads
    Console().print(other_heads(take, half) if heads else own_head(take, half, arguments.film))


if __name__ == "__main__":
    main()
