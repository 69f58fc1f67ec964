import tracemalloc
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.findings import Finding
from usdface.geometry.rigid_fit import Pose
from usdface.options import MapOptions, SolveOptions
from usdface.retarget import rbf
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibration import calibrate_take
from usdface.retarget.marker_errors import (
    _usual,
    estimate_marker_errors,
    marker_error_findings,
)
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.rbf import fit_map
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

RNG = np.random.default_rng(5)
MARKERS, FRAMES, SHAPES = 40, 3600, 6
POINTS = 0.06 * RNG.normal(size=(MARKERS, 3))
MODEL = BlendShapeEvaluator(0.004 * RNG.normal(size=(SHAPES, 3 * MARKERS)))
TIMES = np.arange(FRAMES) / 30.0
WEIGHTS = RNG.uniform(0.0, 1.0, (FRAMES, SHAPES))
USUAL = 3e-4
ASIDE = (0.003, -0.004, 0.0)


def performed(
    errors: FloatArray | float, model: BlendShapeEvaluator = MODEL, noise: float = USUAL
) -> PoseAndWeights:
    """A take whose weights are known; each marker is off by its share of the usual error."""
    drawn = np.random.default_rng(0).normal(size=(FRAMES, model.offsets.shape[1] // 3, 3))
    displaced = model.displacements(WEIGHTS[:, : len(model.offsets)]).reshape(drawn.shape)
    displaced = displaced + noise * np.broadcast_to(errors, drawn.shape[1])[:, None] * drawn
    points = POINTS[: drawn.shape[1]]
    return PoseAndWeights(
        WEIGHTS[:, : len(model.offsets)], Pose.identity(FRAMES), displaced,
        Regularisation(noise, 0.0, SolveOptions()), 1, fit_map(points, points, MapOptions()),
    )  # fmt: skip


def estimated(
    joint: PoseAndWeights,
    points: FloatArray = POINTS,
    model: BlendShapeEvaluator = MODEL,
    *,
    axes: int = 3,
    moving_head: bool = True,
) -> FloatArray:
    motion = MotionModel(points, model, axes, moving_head)
    return estimate_marker_errors(
        TIMES[: len(joint.weights)],
        joint.weights,
        joint.displaced,
        motion,
        joint.regularisation.variance,
    )


@pytest.mark.parametrize("moving_head", [False, True])
@pytest.mark.parametrize("axes", [2, 3])
def test_errors_that_are_known_are_found(axes: int, moving_head: bool) -> None:
    errors = np.ones(MARKERS)
    errors[[3, 17]] = [5.0, 20.0]
    found = estimated(performed(errors), axes=axes, moving_head=moving_head)
    np.testing.assert_allclose(found, errors, rtol=0.12)


def test_what_few_markers_show_is_not_taken_for_their_accuracy() -> None:
    """Its weight follows the one marker that shows a blend shape, and leaves no residual there."""
    offsets = MODEL.offsets.copy()
    offsets[0] = 0.0
    offsets[0, 6:9] = 0.01
    model = replace(MODEL, offsets=offsets)
    joint = performed(1.0, model)
    left = joint.displaced - model.displacements(WEIGHTS).reshape(joint.displaced.shape)
    along = left[:, 2] @ np.ones(3) / 0.03
    fitted = replace(joint, weights=WEIGHTS + np.outer(along, np.eye(SHAPES)[0]))
    found = estimated(fitted, model=model, moving_head=False)
    np.testing.assert_allclose(found, 1.0, rtol=0.12)


def test_an_occluded_marker_tells_its_error_where_it_is_seen() -> None:
    errors = np.ones(MARKERS)
    errors[4] = 10.0
    joint = performed(errors)
    joint.displaced[::3, 4] = np.nan
    joint.displaced[100:700, 5] = np.nan
    np.testing.assert_allclose(estimated(joint), errors, rtol=0.15)


def test_an_expression_of_the_neutral_frames_is_no_error() -> None:
    """It displaces all frames alike, as no weight does; a slip lasts for a part of the take."""
    offsets = MODEL.offsets.copy()
    offsets[0, 9:] = 0.0  # moves three markers
    model = replace(MODEL, offsets=offsets)
    joint = performed(1.0, model)
    at_rest = np.where(np.arange(SHAPES) == 0, 0.0, joint.weights)
    shift = (0.2 + joint.weights[:, :1]) * offsets[0]
    shown = replace(
        joint, weights=at_rest, displaced=joint.displaced - shift.reshape(FRAMES, MARKERS, 3)
    )
    np.testing.assert_array_equal(estimated(shown, model=model), 1.0)
    slips = shown.displaced.copy()
    slips[FRAMES // 2 :, 1] += 0.003
    found = estimated(replace(shown, displaced=slips), model=model)
    assert found[1] > 5.0 and np.delete(found, 1).max() < 1.5


def test_noise_averages_out_and_a_drift_does_not() -> None:
    """Of two markers with the same error in a frame, one is trembling and one drifts."""
    joint = performed(np.where(np.arange(MARKERS) == 3, 5.0, 1.0))
    displaced = joint.displaced.copy()
    displaced[:, 9, 0] += np.linspace(0.0, 15.0 * USUAL, FRAMES)
    found = estimated(replace(joint, displaced=displaced))
    assert found[9] > 1.5 * found[3]


def test_the_order_of_markers_does_not_count() -> None:
    errors = RNG.permutation(np.linspace(0.5, 3.0, MARKERS))
    joint, turned = performed(errors), RNG.permutation(MARKERS)
    model = MODEL.select((3 * turned[:, None] + np.arange(3)).ravel())
    moved = replace(joint, displaced=joint.displaced[:, turned])
    found = estimated(moved, POINTS[turned], model)
    np.testing.assert_allclose(found, estimated(joint)[turned], rtol=1e-8)


def test_what_is_usual_around_many_markers_needs_no_distances_of_all_pairs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    points, ways = RNG.normal(size=(600, 3)), np.ones(600)
    variances = RNG.uniform(1.0, 2.0, 600)
    whole = _usual(variances, points, ways)
    monkeypatch.setattr(rbf, "_CHUNK_ELEMENTS", 20_000)
    tracemalloc.start()
    try:
        parts = _usual(variances, points, ways)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    np.testing.assert_allclose(parts, whole, rtol=1e-12)
    assert peak < 600**2 * 8


@pytest.mark.parametrize("noise", [0.0, 1e-9])
def test_clean_markers_are_alike(noise: float) -> None:
    found = estimated(performed(np.linspace(0.1, 10.0, MARKERS), noise=noise))
    np.testing.assert_allclose(found, 1.0, rtol=1e-6)


def test_a_short_take_says_little() -> None:
    errors = np.ones(MARKERS)
    errors[3] = 20.0
    joint = performed(errors)
    brief = replace(joint, weights=WEIGHTS[:30], displaced=joint.displaced[:30])
    found = estimated(brief)
    assert 1.0 < found[3] < 0.5 * estimated(joint)[3]


def test_a_region_that_moves_otherwise_counts_like_the_rest() -> None:
    """Misfit of two faces is no error of the markers."""
    nearest = np.argsort(((POINTS - POINTS[7]) ** 2).sum(axis=1))[:14]
    errors = np.ones(MARKERS)
    errors[nearest] = 6.0
    inside = nearest[:5]
    np.testing.assert_allclose(estimated(performed(errors))[inside], 1.0, atol=0.2)
    errors[inside[0]] = 30.0
    assert estimated(performed(errors))[inside[0]] == pytest.approx(5.0, rel=0.2)


def test_a_marker_that_moves_farther_may_be_off_by_more() -> None:
    """Misfit is in proportion to motion; a marker that is bound elsewhere is off by more."""
    size = np.where(np.arange(MARKERS) == 7, 6.0, 1.0)
    model = replace(MODEL, offsets=MODEL.offsets * np.repeat(size, 3))
    other = 0.1 * np.random.default_rng(3).normal(size=MODEL.offsets.shape) * model.offsets
    joint = performed(0.3, model)
    displaced = joint.displaced + (WEIGHTS @ other).reshape(joint.displaced.shape)
    found = estimated(replace(joint, displaced=displaced), model=model)
    np.testing.assert_array_less(found, 1.5)
    displaced[:, 7] += (WEIGHTS @ (0.6 * model.offsets[::-1, 21:24])).reshape(-1, 3)
    assert estimated(replace(joint, displaced=displaced), model=model)[7] > 2.0


def test_few_markers_have_no_usual_error() -> None:
    model = MODEL.select(np.arange(18))
    joint = performed(np.array([1.0, 1.0, 1.0, 1.0, 1.0, 9.0]), model)
    found = estimated(joint, POINTS[:6], model)
    np.testing.assert_array_equal(found, 1.0)


def test_the_worst_marker_is_named() -> None:
    names = tuple(f"m{k}" for k in range(MARKERS))
    errors = np.full(MARKERS, 1.9)
    assert not marker_error_findings(errors, names, "take.c3d")
    errors[[3, 8]] = [2.5, 4.0]
    (found,) = marker_error_findings(errors, names, "take.c3d")
    assert (found.code, found.where) == ("MARKER_INACCURATE", "take.c3d")
    assert "m8, whose error is 4.0 times the usual one" in found.message
    assert found.values["markers"] == ["m3", "m8"]


# Whole solves of a marker that slips.


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def slipped(world: World, name: str = "cheek_l", aside: Sequence[float] = ASIDE) -> MarkerTake:
    """The take, twice as long, with noise; from the middle on a marker sits 5 mm aside."""
    positions = np.concatenate([world.take.positions, world.take.positions[NEUTRAL:][::-1]])
    positions = positions + 2e-4 * np.random.default_rng(1).normal(size=positions.shape)
    positions[len(positions) // 2 :, world.take.names.index(name)] += aside
    times = np.arange(len(positions)) / world.take.rate
    return replace(world.take, positions=positions, times=times)


def solved(world: World, take: MarkerTake, options: SolveOptions) -> tuple[Solution, list[Finding]]:
    mesh = world.rig.meshes[0]
    vertices = np.array([world.points[name] for name in take.names])
    setup = RetargetSetup(Binding(take.names, vertices), neutral=(0, NEUTRAL - 1), solve=options)
    return solve_take(
        take,
        BoundPoints.linear(mesh.points[vertices], mesh.offsets_at(vertices), mesh.shape_names),
        setup,
    )


def off(world: World, solution: Solution) -> float:
    truth = np.concatenate([world.weights, world.weights[NEUTRAL:][::-1]])
    return float(np.sqrt(np.mean((solution.weights.weights - truth) ** 2)))


def test_a_marker_that_slips_counts_less(world: World) -> None:
    take, name = slipped(world), "cheek_l"
    found, findings = solved(world, take, SolveOptions())
    alike, silent = solved(world, take, SolveOptions(errors="alike"))
    assert off(world, found) < 0.7 * off(world, alike)
    assert found.errors is not None and alike.errors is None
    assert found.errors.argmax() == found.markers.index(name) and found.errors.max() > 3.0
    (reported,) = (each for each in findings if each.code == "MARKER_INACCURATE")
    assert reported.values["markers"] == [name]
    assert "MARKER_INACCURATE" not in [each.code for each in silent]


def test_a_marker_that_slips_is_no_expression(world: World) -> None:
    """Neither one that the neutral frames show, nor a gain, nor an offset of a performer's file."""
    take = slipped(world, "brow_mid_r", [0.0, 0.006, 0.0])
    found, findings = solved(world, take, SolveOptions())
    codes = [each.code for each in findings]
    assert "NEUTRAL_SHOWS" not in codes and "MARKER_INACCURATE" in codes
    assert off(world, found) < 0.5 * off(
        world, solved(world, take, SolveOptions(errors="alike"))[0]
    )
    take = slipped(world, "corner_r", [0.003, -0.004, 0.0])
    assert "GAIN_FOUND" not in [each.code for each in solved(world, take, SolveOptions())[1]]


def test_calibration_learns_no_slip(world: World) -> None:
    mesh, take = world.rig.meshes[0], slipped(world, "corner_r", [0.0, 0.0, 0.006])
    vertices = np.array([world.points[name] for name in take.names])
    setup = RetargetSetup(Binding(take.names, vertices), neutral=(0, NEUTRAL - 1))
    model, _ = evaluator_of(mesh.shapes, vertices)
    bound = BoundPoints(mesh.points[vertices], mesh.shape_names, model)
    found, _ = calibrate_take(take, bound, setup)
    assert found.calibration.offsets.max() < 0.02


def test_few_frames_say_nothing_of_the_markers(world: World) -> None:
    take = slipped(world)
    few = FEWEST_FRAMES - 1
    short = replace(take, positions=take.positions[:few], times=take.times[:few])
    assert solved(world, short, SolveOptions())[0].errors is None
