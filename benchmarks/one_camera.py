"""Weights from the image of one camera before which the head turns.

    python -m benchmarks.one_camera [--frames N] [--part end]
        [--persons | --beside | --unnamed | --neutrals | --tracks]

Recorded curves on the ICT face with 68 landmarks (without the real data: of the example head),
seen through a perspective camera half a metre away with noise of 0.35 px. Columns: the head removed
to first order, as a distant camera would show it; poses in space with the focal length given, and
with it unknown; the angle by which the found motion of the head is off (RMS). `--part end` has
other curves, another performer, another lens farther away; docs/measurements.md says how often it
has been scored.

`--persons` films the performers of `benchmarks.performers`, whose blend shapes move in other
directions: 1 to 4, at the end 5 to 8; focal length given, mean of four.

`--beside` binds markers 2.4 to 5.6 mm from their places. Columns: the markers held on those
vertices, their places found, and known.

`--unnamed` has the rest in the middle of the film. Columns: the first frame taken as neutral,
neutral frames found, and named.

`--neutrals` has neutral frames that show some blend shapes. Columns: taken as they are, and with
weights that are found.

`--tracks` has dots whose tracks jump to another spot (3 % of the face's width), drift (2 %) or
tremble (1 %). Columns: all dots count alike, and by their errors.
"""

import argparse
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.performers.shown_neutral import NEUTRALS, shown_weights
from benchmarks.performers.worlds import BUILT_WITH, JUDGED_ON, ROWS, Performance, perform
from benchmarks.solve.faces import Face, bent, example, has_real_data, ict
from usdface.arrays import FloatArray, IntArray
from usdface.binding.bound_neutral import bound_neutral
from usdface.face.bound_face import bound_face
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.rigid_fit import Pose
from usdface.options import SolveOptions, SolvePlaces
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.solve_take import solve_take
from usdface.retarget_take.solve import solve
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
SIZE, NOISE, REST = (1280, 960), 0.35, 15
ANGLES = (0.0, 8.0, 20.0, 35.0)
BEND = 0.004  # of another performer [m]
BESIDE = 0.004  # m
FAULTS = {"no fault": 0, "two jump": 2, "four drift": 4, "four tremble": 4}


@dataclass(frozen=True, slots=True)
class Part:
    """Curves from a frame on, a camera's lens [px] and distance [m], other performers.

    Attributes
    ----------
    seed : int
        Of the one who is the character, bent.
    persons : tuple of int
        Those of `benchmarks.performers`.
    """

    start: int
    seed: int
    focal_length: float
    distance: float
    persons: tuple[int, ...]


PARTS = {
    "built with": Part(0, 3, 1500.0, 0.5, BUILT_WITH),
    "end": Part(2015, 7, 1100.0, 0.7, JUDGED_ON),
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--part", choices=PARTS, default="built with")
    parser.add_argument("--persons", action="store_true")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--unnamed", action="store_true")
    parser.add_argument("--neutrals", action="store_true")
    parser.add_argument("--tracks", action="store_true")
    parsed = parser.parse_args()
    part = PARTS[parsed.part]
    face = ict(DATA) if has_real_data(DATA) else example()
    face = replace(face, curves=face.curves[part.start :][: parsed.frames])
    if parsed.persons:
        return persons(face, part)
    if parsed.beside:
        return beside(face, part)
    if parsed.unnamed:
        return unnamed(face, part)
    if parsed.neutrals:
        return neutrals(face, part)
    if parsed.tracks:
        return tracks(face, part)
    print("| performer | head | first order | focal length given | unknown | pose [degrees] |")
    print("|---|---|---|---|---|---|")
    for who, performer in (("the character", face), ("another", bent(face, part.seed, BEND))):
        for angle in ANGLES:
            take, motion = film(face, performer, angle, part)
            given, turned = error(face, replace(take, focal_length=part.focal_length), motion)
            found, _ = error(face, take, motion)
            flat = first_order(face, take)
            row = f"{who} | {head_of(angle)} | {flat:.3f} | {given:.3f} | {found:.3f}"
            print(f"| {row} | {turned:.2f} |")


def persons(face: Face, part: Part) -> None:
    """Print the errors of films of other people, whose blend shapes are their own."""
    print("| head | error | of each |")
    print("|---|---|---|")
    curves = slice(part.start, part.start + len(face.curves))
    people = [perform(DATA, number, ROWS[0], part=curves) for number in part.persons]
    for angle in ANGLES:
        errors = []
        for person in people:
            take, motion = film(face, person, angle, part)
            errors.append(error(face, replace(take, focal_length=part.focal_length), motion)[0])
        each = ", ".join(f"{one:.3f}" for one in errors)
        print(f"| {head_of(angle)} | {np.mean(errors):.4f} | {each} |", flush=True)


def beside(face: Face, part: Part) -> None:
    """Print the errors with markers that are bound beside their places."""
    print("| performer | head | held on vertices | places found | places known |")
    print("|---|---|---|---|---|")
    wrong = vertices_beside(face, BESIDE, part.seed)
    for who, performer in (("the character", face), ("another", bent(face, part.seed, BEND))):
        for angle in ANGLES:
            take, motion = film(face, performer, angle, part)
            take = replace(take, focal_length=part.focal_length)
            bound = replace(face, points=wrong)
            errors = [
                error(bound, take, motion, places="bound")[0],
                error(bound, take, motion)[0],
                error(face, take, motion)[0],
            ]
            print(
                f"| {who} | {head_of(angle)} | "
                + " | ".join(f"{each:.3f}" for each in errors)
                + " |"
            )


def unnamed(face: Face, part: Part) -> None:
    """Print the errors of a film that rests in the middle, with neutral frames that are found."""
    print("| performer | head | first frame | found | named |")
    print("|---|---|---|---|---|")
    middle = len(face.curves) // 2
    for who, performer in (("the character", face), ("another", bent(face, part.seed, BEND))):
        for angle in ANGLES:
            take, _ = film(face, performer, angle, part, middle)
            take = replace(take, focal_length=part.focal_length)
            found = bound_neutral(take, bound_face(face.mesh, setup_of(face)))
            errors = []
            for neutral in ((0, 0), found, (middle, middle + REST - 1)):
                setup = replace(setup_of(face), neutral=neutral)
                solution, _ = solve(take, bound_face(face.mesh, setup), setup, cleaned=None)
                weights = solution.weights
                errors.append(
                    float(np.sqrt(np.mean((weights.weights - played(face, middle)) ** 2)))
                )
            print(
                f"| {who} | {head_of(angle)} | "
                + " | ".join(f"{each:.3f}" for each in errors)
                + " |"
            )


def neutrals(face: Face, part: Part) -> None:
    """Print the errors of a film whose neutral frames show something."""
    print("| performer | head | the neutral shows | as it is | weights found |")
    print("|---|---|---|---|---|")
    for who, performer in (("the character", face), ("another", bent(face, part.seed, BEND))):
        for angle, name in product((0.0, 20.0), NEUTRALS):
            shown = shown_weights(name, face.mesh.shape_names, part.seed)
            take, _ = film(face, performer, angle, part, shown=shown)
            take = replace(take, focal_length=part.focal_length)
            print_by_setting(f"{who} | {head_of(angle)} | {name}", face, take, "neutral", "given")


def tracks(face: Face, part: Part) -> None:
    """Print the errors of a film in which the tracks of some dots are off."""
    print("| performer | head | tracks | all count alike | errors found |")
    print("|---|---|---|---|---|")
    for who, performer in (("the character", face), ("another", bent(face, part.seed, BEND))):
        for angle, fault in product((0.0, 20.0), FAULTS):
            take, _ = film(face, performer, angle, part)
            take = with_fault(replace(take, focal_length=part.focal_length), fault, part.seed)
            print_by_setting(f"{who} | {head_of(angle)} | {fault}", face, take, "errors", "alike")


def print_by_setting(row: str, face: Face, take: MarkerTake, name: str, plain: str) -> None:
    """Print the error of a take where a setting of the solve is `plain`, and where it is found."""
    errors = []
    for value in (plain, "found"):
        setup = setup_of(face)
        setup = replace(setup, solve=replace(setup.solve, **{name: value}))
        solution, _ = solve(take, bound_face(face.mesh, setup), setup, cleaned=None)
        weights = solution.weights
        errors.append(off(face, weights.weights))
    print(f"| {row} | {errors[0]:.3f} | {errors[1]:.3f} |")


def head_of(angle: float) -> str:
    """Return what the head does."""
    return f"turns by {angle:g} degrees" if angle else "rests"


def with_fault(take: MarkerTake, fault: str, seed: int) -> MarkerTake:
    """Return a take in which the tracks of some dots are off by a share of the face's width."""
    rng, positions = np.random.default_rng([3000, seed]), take.positions.copy()
    count, markers, _ = positions.shape
    width = float(np.ptp(positions[0, :, 0]))
    some = rng.choice(markers, FAULTS[fault], replace=False)
    ways = rng.normal(size=(len(some), 2))
    ways *= width / np.linalg.norm(ways, axis=1, keepdims=True)
    if fault == "two jump":
        positions[count // 2 :, some] += 0.03 * ways
    if fault == "four drift":
        positions[:, some] += np.linspace(0.0, 0.02, count)[:, None, None] * ways
    if fault == "four tremble":
        positions[:, some] += 0.01 * width * rng.normal(size=(count, len(some), 2))
    return replace(take, positions=positions)


def vertices_beside(face: Face, away: float, seed: int) -> IntArray:
    """Return vertices (M,) around those of the markers, by 0.6 to 1.4 times `away` [m]."""
    rng, points = np.random.default_rng(seed), face.mesh.points
    surface = MarkerSurface(face.mesh, face.points)
    drawn = []
    for marker, vertex in enumerate(face.points.tolist()):
        near = surface.vertices_near(marker)
        length = np.linalg.norm(points[near] - points[vertex], axis=1)
        there = near[np.abs(length / away - 1.0) < 0.4]
        drawn.append(int(rng.choice(there)) if len(there) else vertex)
    return np.array(drawn)


def played(face: Face, rest: int, shown: FloatArray | float = 0.0) -> FloatArray:
    """Return the curves of a face as weights (F, S) that rest, or show (S,), from a frame on."""
    still = np.zeros((REST, face.curves.shape[1])) + shown
    return np.concatenate([face.curves[:rest], still, face.curves[rest:]])


def film(
    face: Face,
    performer: Face | Performance,
    angle: float,
    part: Part,
    rest: int = 0,
    shown: FloatArray | float = 0.0,
) -> tuple[MarkerTake, Pose]:
    """Return a take of curves on `performer` that rest from a frame on, and the head's motion.

    At rest it shows weights (S,).
    """
    weights = played(face, rest, shown)
    moved = np.tensordot(weights, performer.offsets, 1)
    centre = performer.neutral.mean(axis=0)
    times = np.arange(len(weights)) / face.rate
    grows = np.clip((np.arange(len(times)) - REST) / 30.0, 0.0, 1.0)[:, None]
    swing = angle * grows * np.sin(np.outer(times, [1.1, 0.7, 0.9])) * [0.5, 1.0, 0.3]
    shift = 0.01 * bool(angle) * grows * np.sin(np.outer(times, [0.8, 0.5, 0.3]))
    motion = Pose(Rotation.from_euler("xyz", swing, degrees=True).as_matrix(), shift)
    before = motion.to_take(performer.neutral + moved - centre) - np.array(
        [0.0, 0.0, part.distance]
    )
    image = PinholeCamera(part.focal_length, 0.5 * np.array(SIZE) * [1, -1]).image(before)
    image += NOISE * np.random.default_rng(0).standard_normal(image.shape)
    return MarkerTake(face.names, times, image, face.rate, image_size=SIZE), motion


def setup_of(face: Face, places: SolvePlaces = "found") -> RetargetSetup:
    """Return the binding of a face, with its neutral frames."""
    binding = Binding(face.names, face.points)
    return RetargetSetup(binding, neutral=(0, REST - 1), solve=SolveOptions(places=places))


def error(
    face: Face, take: MarkerTake, motion: Pose, places: SolvePlaces = "found"
) -> tuple[float, float]:
    """Return the RMS errors of the weights and of the head's turn [degrees]."""
    setup = setup_of(face, places)
    solution, _ = solve(take, bound_face(face.mesh, setup), setup, cleaned=None)
    weights = solution.weights
    assert solution is not None
    away = solution.pose.rotations @ motion.rotations.transpose(0, 2, 1)
    turned = np.degrees(Rotation.from_matrix(away).magnitude())
    return off(face, weights.weights), float(np.sqrt(np.mean(turned**2)))


def first_order(face: Face, take: MarkerTake) -> float:
    """Return the RMS error of the weights where the image is taken as flat."""
    names = face.mesh.shape_names
    solution, _ = solve_take(
        take, BoundPoints.linear(face.neutral, face.offsets, names), setup_of(face)
    )
    return off(face, solution.weights.weights)


def off(face: Face, weights: FloatArray) -> float:
    """Return the RMS error of weights."""
    return float(np.sqrt(np.mean((weights[REST:] - face.curves) ** 2)))


if __name__ == "__main__":
    main()
