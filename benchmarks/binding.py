"""Proposed vertices: `python benchmarks/binding.py [named | neutral | rests | given]`.

Performers are the faces of tests/faces.py bent at random, each shape 0.8 to 1.25 as strong, driven
by recorded range-of-motion curves with head motion and 0.3 mm of noise; their markers are shuffled,
turned, scaled and nameless. AnimFace's optical takes, nameless as well, are put on the ICT face,
judged by the binding that a person made for the tests. `named` puts them on three heads, with their
names and those that other marker sets would give them. See README.md.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray, IntArray
from usdface.binding.face_surface import face_surface
from usdface.binding.landmarks import find_landmarks
from usdface.binding.neutral_frames import neutral_frames
from usdface.binding.proposal import proposal_findings
from usdface.binding.propose import propose
from usdface.errors import InputError
from usdface.io.bind_file import read_bind
from usdface.io.takes.files import read_take
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from face_answers import range_of_motion  # noqa: E402
from faces import Face, make_face  # noqa: E402
from marker_sets import MARKER_SETS, renamed  # noqa: E402

from benchmarks.solve.faces import random_bend  # noqa: E402

KINDS = ("ict68", "ict41", "makehuman", "example")
SEEDS, ANCHORS = (11, 12), (0, 3, 6)
MEASURED = {"ict41": 0, "makehuman": 3, "example": 0}  # for figures(): how many are given
FAR = 0.030  # m, beyond which a vertex is simply wrong
REST = 10  # frames at the start in which the weights are 0


@dataclass(frozen=True, eq=False)
class Case:
    """A take, the true vertices of its markers, and its true weights where they are known."""

    name: str
    mesh: Mesh
    take: MarkerTake
    truth: IntArray
    weights: FloatArray | None


def curves(face: Face) -> tuple[FloatArray, float]:
    """Return every fourth recorded frame as weights of the face, after a rest."""
    weights, rate = every_frame(face)
    still = np.zeros((REST, weights.shape[1]))
    return np.concatenate([still, weights[::4]]), rate / 4


def every_frame(face: Face) -> tuple[FloatArray, float]:
    """Return recorded curves as weights of the face; by column where names differ."""
    try:
        return range_of_motion(face, SHARED)
    except InputError:
        recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
        used = np.resize(np.flatnonzero(recorded.weights.max(axis=0) > 0.3), len(face.mesh.shapes))
        order = np.random.default_rng(7).permutation(used)
        return recorded.weights[:, order].clip(0, 1), recorded.rate


def rested(weights: FloatArray, seed: int, count: int) -> FloatArray:
    """Return curves that come down to 0, after a rest that shows `count` shapes at up to 0.35."""
    moving = weights[REST:]
    low = np.quantile(moving, 0.15, axis=0)
    rng, shown = np.random.default_rng(seed), np.zeros(weights.shape[1])
    if count:
        shown[rng.choice(len(shown), count, replace=False)] = rng.uniform(0.05, 0.35, count)
    return np.concatenate([np.tile(shown, (REST, 1)), ((moving - low) / (1 - low)).clip(0, 1)])


def simulated(kind: str, seed: int, shown: int | None = None) -> Case:
    weights, rate = curves(make_face(kind, SHARED))
    if shown is not None:
        weights = rested(weights, seed, shown)
    return performed(kind, seed, weights, rate)


def performed(kind: str, seed: int, weights: FloatArray, rate: float) -> Case:
    """Let a performer play weights (F, S)."""
    face, rng = make_face(kind, SHARED), np.random.default_rng(seed)
    vertices = face.setup.binding.points
    times, positions = acted(face, rng, seed, weights, rate)
    positions += 3e-4 * rng.normal(size=positions.shape)
    order = rng.permutation(len(vertices))
    anyhow = Rotation.random(random_state=seed).as_matrix()
    positions = rng.uniform(0.7, 1.4) * (positions[:, order] @ anyhow.T) + rng.normal(size=3)
    names = tuple(f"m{i}" for i in range(len(order)))
    take = MarkerTake(names, times, positions, rate, source=kind)
    return Case(f"{kind} {seed}", face.mesh, take, vertices[order], weights)


def acted(
    face: Face, rng: np.random.Generator, seed: int, weights: FloatArray, rate: float
) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and markers (F, M, 3) [m] of another person, whose head moves."""
    vertices = face.setup.binding.points
    rest = face.mesh.points[vertices]
    neutral, turn = random_bend(1000 + seed, rest, rest, 0.004, 0.05)
    strengths = rng.uniform(0.8, 1.25, (len(face.mesh.shapes), 1, 1))
    moves = np.einsum("mde,sme->smd", turn, strengths * face.mesh.offsets_at(vertices))
    positions = neutral + np.einsum("fs,smd->fmd", weights, moves)
    times = np.arange(len(weights)) / rate
    phases = 2 * np.pi * times[:, None] / [7.0, 7.0, 7.0] + [0.0, 2.0, 4.0]
    angles = np.radians(6) * np.sin(phases) * np.minimum(1, times)[:, None]
    neck = neutral.mean(axis=0) - [0.0, 0.08, 0.06]
    turned = Rotation.from_rotvec(angles).as_matrix()
    positions = np.einsum("fij,fmj->fmi", turned, positions - neck)
    return times, positions + 0.014 * np.sin(phases * 1.4)[:, None]


def recorded(name: str) -> Case:
    face = make_face("ict41", SHARED)
    take, _ = read_take(SHARED / "animface" / f"{name}.c3d")
    positions = take.select(face.setup.binding.markers)
    names = tuple(f"m{i}" for i in range(positions.shape[1]))
    only = replace(take, names=names, positions=positions)
    return Case(f"AnimFace {name}", face.mesh, only, face.setup.binding.points, None)


def errors(case: Case, setup: RetargetSetup) -> dict[str, FloatArray]:
    """Return for each marker: distance along the skin, wrong side; inf if it is left out.

    Places that are unsure count like the others.
    """
    found_in = (setup.binding, setup.unsure)
    place = {n: v for b in found_in for n, v in zip(b.markers, b.points.tolist(), strict=True)}
    points, skin = case.mesh.points, face_surface(case.mesh)
    found = np.array([place.get(name, -1) for name in case.take.names])
    column = np.searchsorted(skin.vertices, found).clip(max=len(skin.vertices) - 1)
    along = skin.distances(case.truth)[np.arange(len(found)), column]
    straight = np.linalg.norm(points[found] - points[case.truth], axis=1)
    across = points[found, 0] * np.sign(points[case.truth, 0]) < -0.002
    side = across & (np.abs(points[case.truth, 0]) > 0.004)
    sure = {n: c for b in found_in for n, c in zip(b.markers, b.confidence.tolist(), strict=True)}
    return {
        "along": np.where(found >= 0, along, np.inf),
        "side": side & (found >= 0),
        # Near in space and far along the skin: the other lip, the other lid.
        "lip": (straight < 0.01) & (along > 0.015) & (found >= 0),
        "sure": np.array([sure.get(name, 0.0) for name in case.take.names]),
    }


def weight_error(case: Case, setup: RetargetSetup) -> float:
    """Return the RMS weight error; NaN where no place was sure enough to be bound."""
    if not setup.binding.markers:
        return float("nan")
    solution = solved(case, setup)
    return float(np.sqrt(np.mean((solution.weights.weights - case.weights) ** 2)))


def solved(case: Case, setup: RetargetSetup) -> Solution:
    points = setup.binding.points
    offsets = case.mesh.offsets_at(points)
    return solve_take(
        case.take,
        BoundPoints.linear(case.mesh.points[points], offsets, case.mesh.shape_names),
        setup,
    )[0]


def as_neutral(setup: RetargetSetup) -> RetargetSetup:
    """Return a setup whose neutral frames show nothing."""
    return replace(setup, solve=replace(setup.solve, neutral="given"))


def figures() -> dict[str, float]:
    """Return how good proposals are on four takes, for `benchmarks/sensitivity.py`."""
    simulations = [(simulated(kind, SEEDS[0]), count) for kind, count in MEASURED.items()]
    return proposal_figures([*simulations, (recorded("Jaw"), 3)])


def example_figures() -> dict[str, float]:
    """Return the same of one take, on the example's head with three markers given: seconds."""
    return proposal_figures([(simulated("example", SEEDS[0]), 3)])


def proposal_figures(cases: Sequence[tuple[Case, int]]) -> dict[str, float]:
    """Return errors of proposals for takes of which so many markers are given."""
    found, right = [], []
    for case, count in cases:
        order = np.random.default_rng(5).permutation(len(case.truth))
        there = np.isin(case.truth[order], face_surface(case.mesh).vertices)
        chosen = order[there][:count]
        given = Binding(tuple(case.take.names[i] for i in chosen), case.truth[chosen])
        setup = RetargetSetup(given, neutral=neutral_frames(case.take))
        off = errors(case, propose(case.take, case.mesh, setup).setup)
        rest = np.setdiff1d(np.arange(len(case.truth)), chosen)
        found.append(1000 * off["along"][rest].clip(max=FAR))
        right.append(np.stack([off["sure"][rest], off["along"][rest] < 0.010]))
    sure, near = np.concatenate(right, axis=1)
    return {
        "off mm": float(np.mean([each.mean() for each in found])),
        "within 10 mm %": 100 * float(np.mean([each[1].mean() for each in right])),
        # Mean squared difference of confidence and truth (Brier 1950).
        "Brier": float(np.mean((sure - near) ** 2)),
    }


def anchor_figures() -> dict[str, float]:
    """Return both mistakes of the check of given vertices, for `benchmarks/sensitivity.py`."""
    cases = [one for kind in ("ict41", "example") for one in checked_anchors(kind, (3, 6))]
    return {
        "wrong and doubted %": 100 * float(np.mean([wrong for _, wrong, _ in cases])),
        "right and doubted": float(sum(right for _, _, right in cases)),
    }


def neutral_figures() -> dict[str, float]:
    """Return RMS errors of the weights that neutral frames show, where some do and where none."""
    found: dict[str, float] = {}
    for name, seed, count in (("neutral", 11, 0), ("12 shapes", 12, 12)):
        errors = []
        for kind in KINDS:
            case = simulated(kind, seed, count)
            setup = RetargetSetup(Binding(case.take.names, case.truth), neutral=(0, REST - 1))
            estimate = solved(case, setup).neutral_weights
            estimated = np.array([estimate.get(n, 0.0) for n in case.mesh.shape_names])
            errors.append(np.mean((estimated - case.weights[0]) ** 2))
        found[name] = float(np.sqrt(np.mean(errors)))
    return found


def rests() -> None:
    """What it costs to take a rest that shows something as neutral."""
    table = Table(title="weight RMS error where the rest shows some shapes")
    for column in ("take", "shapes", "as neutral", "weights found", "less the true"):
        table.add_column(column, justify="right")
    for kind in KINDS:
        for seed, count in ((11, 0), (11, 8), (12, 12)):
            case = simulated(kind, seed, count)
            setup = RetargetSetup(Binding(case.take.names, case.truth), neutral=(0, REST - 1))
            true = dict(zip(case.mesh.shape_names, case.weights[0].tolist(), strict=True))
            less_true = replace(setup, neutral_weights=true)
            errors = [weight_error(case, each) for each in (as_neutral(setup), setup, less_true)]
            table.add_row(case.name, str(count), *(f"{error:.3f}" for error in errors))
    Console(width=130).print(table)


def checked_anchors(kind: str, counts: Sequence[int]) -> Iterator[tuple[int, bool, int]]:
    """Yield how many vertices are given, if the wrong one is doubted, and how many right ones.

    The wrong one is 30 to 60 mm away along the surface.
    """
    case = simulated(kind, SEEDS[0])
    skin, rng = face_surface(case.mesh), np.random.default_rng(1)
    there = np.flatnonzero(np.isin(case.truth, skin.vertices))
    for count in counts:
        chosen = rng.choice(there, count, replace=False)
        points, names = case.truth[chosen], [case.take.names[i] for i in chosen]
        far = skin.distances(points[:1])[0]
        places = points.copy()
        places[0] = skin.vertices[rng.choice(np.flatnonzero((far > 0.03) & (far < 0.06)))]
        doubted = []
        for given in (places, points):
            setup = RetargetSetup(Binding(tuple(names), given), neutral=neutral_frames(case.take))
            found = propose(case.take, case.mesh, setup).doubted
            doubted.append([name for name, _ in found])
        right = len(doubted[1]) + len(set(doubted[0]) - {names[0]})
        yield count, names[0] in doubted[0], right


def wrong_given() -> None:
    """Is a given vertex that is wrong doubted, and no other?"""
    table = Table(title="given vertices")
    for column in ("take", "given", "wrong doubted", "right doubted"):
        table.add_column(column, justify="right")
    for kind in KINDS:
        for count, wrong, right in checked_anchors(kind, (1, 3, 6)):
            table.add_row(f"{kind} {SEEDS[0]}", str(count), str(wrong), str(right))
    Console(width=130).print(table)


def named_neutral() -> None:
    """Without given markers, but with the neutral frames named as a person would."""
    table = Table(title="proposed places, neutral frames named")
    for column in ("take", "5 mm", "10 mm", "of those that move 3 mm", "confidence"):
        table.add_column(column, justify="right")
    nothing = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=(0, REST - 1))
    for case in (simulated(kind, seed) for kind in KINDS for seed in SEEDS):
        found = errors(case, propose(case.take, case.mesh, nothing).setup)
        near, close = found["along"] < 0.010, found["along"] < 0.005
        moved = np.linalg.norm(case.mesh.offsets_at(case.truth), axis=2).max(axis=0) > 0.003
        shares = (close.mean(), near.mean(), near[moved].mean())
        sure = f"{found['sure'].mean():.2f}"
        table.add_row(case.name, *(f"{100 * share:.0f} %" for share in shares), sure)
    Console(width=130).print(table)


@cache
def head_mesh(head: str) -> Mesh:
    return make_face({"ict": "ict41"}.get(head, head), SHARED).mesh


def named_case(head: str, take: str, marker_set: str) -> Case:
    """Return AnimFace's take with the names of a marker set, and places set by hand on a head."""
    mesh = head_mesh(head)
    bind, _ = read_bind(ROOT / "tests" / "data" / f"animface_{head}_bind.json")
    place = dict(zip(bind.binding.markers, bind.binding.points.tolist(), strict=True))
    recorded, _ = read_take(SHARED / "animface" / f"{take}.c3d")
    truth = np.array([place[name] for name in recorded.names])
    return Case(f"{take} on {head}", mesh, renamed(recorded, marker_set), truth, None)


def named_row(case: Case) -> tuple[FloatArray, FloatArray, int, int, str]:
    """Return errors by the distance of the eyes' outer corners, confidences, wrong places, codes.

    A place is wrong where it is nearer to the place of another marker than to its own.
    """
    nothing = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=(0, 0))
    proposal = propose(case.take, case.mesh, nothing, find_neutral=True)
    found_in = (proposal.setup.binding, proposal.setup.unsure)
    place = {n: v for b in found_in for n, v in zip(b.markers, b.points.tolist(), strict=True)}
    points = case.mesh.points
    found = points[[place[name] for name in case.take.names]]
    landmarks = find_landmarks(face_surface(case.mesh))
    outer = landmarks.points[np.abs(landmarks.average[:, 0]) == 46.0]
    apart = np.linalg.norm(found[:, None] - points[case.truth], axis=2)
    wrong = int((apart.argmin(axis=1) != np.arange(len(found))).sum())
    codes = {f.code for f in proposal_findings(proposal, "")} - {"BIND_PROPOSED", "PLACE_UNSURE"}
    sure = errors(case, proposal.setup)["sure"]
    off = np.diagonal(apart) / np.linalg.norm(outer[0] - outer[1])
    return off, sure, wrong, len(found_in[0].markers), " ".join(sorted(codes))


def named_figures() -> dict[str, float]:
    """Return median errors of named takes on three heads [% of the eye corners' distance]."""
    found = {}
    for head, take in product(("ict", "makehuman", "example"), ("Jaw", "Eyebrows")):
        off, _, wrong, _, _ = named_row(named_case(head, take, "animface"))
        found |= {
            f"{take} on {head} %": 100 * float(np.median(off)),
            f"{take} on {head}, wrong": wrong,
        }
    return found


def named() -> None:
    """AnimFace's takes with names, on three heads, nothing given."""
    table = Table(title="named takes: errors by the distance of the outer eye corners")
    heads = ("take", "names", "bound", "median", "mean", "largest", "wrong", "confidence", "10 mm")
    for column in (*heads, "findings"):
        table.add_column(column, justify="right")
    said = []
    for head in ("ict", "makehuman", "example"):
        sets = [name for name in MARKER_SETS if name != "anonymous"]
        for take, marker_set in [("Eyebrows", "animface"), *(("Jaw", name) for name in sets)]:
            case = named_case(head, take, marker_set)
            off, sure, wrong, bound, codes = named_row(case)
            near = off < 0.11  # 10 mm on a human face
            said.append(np.stack([sure, near], axis=1))
            figures = [f"{100 * f(off):.1f} %" for f in (np.median, np.mean, np.max)]
            table.add_row(
                *(case.name, marker_set, str(bound), *figures, str(wrong)),
                *(f"{sure.mean():.2f}", f"{100 * near.mean():.0f} %", codes),
            )
    console = Console(width=150)
    console.print(table)
    print_confidence(console, np.concatenate(said))


def print_confidence(console: Console, said: FloatArray) -> None:
    """Print how many places of a confidence are right."""
    sure, right = said.T
    for low, high in pairwise((0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.01)):
        here = (sure >= low) & (sure < high)
        share = f"{100 * right[here].mean():.0f} %" if here.any() else "-"
        console.print(f"confidence {low:.2f} to {high:.2f}: {here.sum()} places, {share} right")


def main() -> None:
    table = Table(title="proposed places, of the markers that are not given")
    heads = ("take", "given", "5 mm", "10 mm", "side", "lip", "confidence")
    for column in (*heads, "weights: true", "proposed", "and neutral", "weights found"):
        table.add_column(column, justify="right")
    said: list[FloatArray] = []
    cases = [simulated(kind, seed) for kind in KINDS for seed in SEEDS]
    for case in (*cases, recorded("Jaw"), recorded("Eyebrows")):
        order = np.random.default_rng(5).permutation(len(case.truth))
        skin = set(face_surface(case.mesh).vertices.tolist())
        order = [i for i in order if int(case.truth[i]) in skin]
        for count in ANCHORS:
            chosen = order[:count]
            given = Binding(tuple(case.take.names[i] for i in chosen), case.truth[chosen])
            proposal = propose(case.take, case.mesh, RetargetSetup(given), find_neutral=True).setup
            found = errors(case, proposal)
            rest = np.setdiff1d(np.arange(len(case.truth)), chosen)
            near = found["along"][rest] < 0.010
            said.append(np.stack([found["sure"][rest], near], axis=1))
            row = [f"{100 * (found['along'][rest] < 0.005).mean():.0f} %"]
            row += [f"{100 * near.mean():.0f} %", str(found["side"].sum()), str(found["lip"].sum())]
            row += [f"{found['sure'][rest].mean():.2f}"]
            if case.weights is not None:
                true = RetargetSetup(Binding(case.take.names, case.truth), neutral=(0, REST - 1))
                at_rest = replace(proposal, neutral=true.neutral)
                setups = map(as_neutral, (true, at_rest, proposal))
                row += [f"{weight_error(case, each):.3f}" for each in (*setups, proposal)]
            table.add_row(case.name, str(count), *row)
    console = Console(width=130)
    console.print(table)
    print_confidence(console, np.concatenate(said))


if __name__ == "__main__":
    parts = {
        **{"all": main, "named": named, "neutral": named_neutral, "rests": rests},
        "given": wrong_given,
    }
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", nargs="?", choices=parts, default="all")
    parts[parser.parse_args().part]()
