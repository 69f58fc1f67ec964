from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.options import HeadMode, MapOptions
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.rbf import fit_map
from usdface.retarget.solve_problem import SolveProblem
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

RNG = np.random.default_rng(8)
FRAMES, MARKERS, SHAPES = 90, 30, 8
TIMES = np.arange(FRAMES) / 30
FACE = RNG.normal(size=(MARKERS, 3)) * [0.07, 0.09, 0.03]
BASIS = 0.01 * RNG.normal(size=(SHAPES, MARKERS, 3))
MODEL = BlendShapeEvaluator(BASIS.reshape(len(BASIS), -1))
TRUTH = np.clip(0.5 + 0.7 * np.sin(TIMES[:, None] * RNG.uniform(1, 4, SHAPES)), 0, 1)
STILL = FACE + np.einsum("fs,smi->fmi", TRUTH, BASIS)
TURN = Rotation.from_euler(
    "xyz", np.stack([8 * np.sin(TIMES), 6 * np.cos(TIMES), 4 * np.sin(2 * TIMES)], 1), degrees=True
)
MOVING = Pose(TURN.as_matrix(), 0.02 * np.stack([np.sin(TIMES)] * 3, 1))


def solve(positions: np.ndarray, head: HeadMode, **map_options: float) -> PoseAndWeights:
    names = tuple(f"m{i}" for i in range(MARKERS))
    setup = RetargetSetup(Binding(names, np.arange(MARKERS)), head=head, head_markers=names[:3])
    neutral = FACE[:, : positions.shape[2]] * (1000.0 if positions.shape[2] == 2 else 1.0)
    space = fit_map(neutral, FACE, MapOptions(**map_options))  # type: ignore[arg-type]
    first = Pose.identity(FRAMES)
    if head == "solve" and positions.shape[2] == 3:
        first, _ = rigid_fit(FACE, positions)
    problem = SolveProblem(TIMES, positions, FACE, MODEL, space, first, setup)
    return solve_pose_and_weights(problem)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_pose_and_weights_are_found_together_exactly() -> None:
    joint = solve(MOVING.to_take(STILL), "solve")
    assert rms(joint.weights - TRUTH) < 1e-6
    np.testing.assert_allclose(joint.pose.rotations, MOVING.rotations, atol=1e-6)
    np.testing.assert_allclose(joint.pose.translations, MOVING.translations, atol=1e-7)


def test_a_rigid_fit_of_face_markers_would_be_far_off() -> None:
    """Why the pose is in the solve: held at the rigid fit, the weights are wrong."""
    positions = MOVING.to_take(STILL)
    pose, _ = rigid_fit(FACE, positions)
    held = solve(pose.to_head(positions), "stabilised")
    assert rms(held.weights - TRUTH) > 0.02


def test_any_motion_of_the_head_gives_the_same_weights() -> None:
    noisy = STILL + 2e-4 * RNG.normal(size=STILL.shape)
    still, moved = solve(noisy, "solve"), solve(MOVING.to_take(noisy), "solve")
    assert rms(still.weights - moved.weights) < 1e-5


def test_noise_costs_little_more_than_with_the_pose_known() -> None:
    noise = 3e-4 * RNG.normal(size=STILL.shape)
    known = solve(STILL + noise, "stabilised")
    found = solve(MOVING.to_take(STILL + noise), "solve")
    assert rms(found.weights - TRUTH) < 1.25 * rms(known.weights - TRUTH)
    assert found.regularisation.noise == pytest.approx(3e-4, rel=0.1)


def test_hidden_markers_are_what_the_rig_predicts() -> None:
    positions = MOVING.to_take(STILL)
    positions[20:50, :6] = np.nan
    positions[60:62] = np.nan  # nobody sees anything
    joint = solve(positions, "solve")
    seen = np.ones(FRAMES, dtype=bool)
    seen[59:63] = False
    assert rms((joint.weights - TRUTH)[seen]) < 1e-3
    assert np.isfinite(joint.weights).all()
    assert np.isnan(joint.displaced[20:50, :6]).all()


def test_an_image_gives_the_weights_back() -> None:
    image = STILL[..., :2] * 1000.0
    joint = solve(image, "stabilised", smoothing=0.0, radius=1.0)
    assert rms(joint.weights - TRUTH) < 0.1


def test_a_head_that_sways_in_the_image_costs_little() -> None:
    image = STILL[..., :2] * 1000.0
    swayed = image + 30.0 * np.sin(TIMES)[:, None, None]
    still, moved = solve(image, "solve"), solve(swayed, "solve")
    assert rms(still.weights - moved.weights) < 0.01


LONG = np.arange(150) / 30
_BEAT, _PHASE = RNG.uniform(1, 4, SHAPES), RNG.uniform(0, 6, SHAPES)
BUSY = np.clip(0.5 + 0.9 * np.sin(LONG[:, None] * _BEAT + _PHASE), 0, 1)
RARE = np.clip(-0.3 + 0.9 * np.sin(LONG[:, None] * _BEAT + _PHASE), 0, 1)


def solve_measured(
    truth: np.ndarray,
    frames: int | None,
    *,
    seed: int = 0,
    noise: float = 5e-4,
    exact: bool = False,
    head: HeadMode = "stabilised",
    start: np.ndarray | None = None,
    positions: np.ndarray | None = None,
    least_noise: float = 0.0,
) -> PoseAndWeights:
    """Solve a noisy take whose neutral is the mean of one noisy frame, unless it is exact."""
    rng = np.random.default_rng(seed)
    if positions is None:
        positions = FACE + np.einsum("fs,smi->fmi", truth, BASIS)
        positions = positions + noise * rng.normal(size=positions.shape)
    neutral = FACE if exact else FACE + noise * rng.normal(size=FACE.shape)
    names = tuple(f"m{i}" for i in range(MARKERS))
    setup = RetargetSetup(Binding(names, np.arange(MARKERS)), head=head, head_markers=names[:3])
    space = replace(fit_map(neutral, FACE, MapOptions(smoothing=1e3)), start=start)
    first = Pose.identity(len(positions))
    if head == "solve" and positions.shape[2] == 3:
        first, _ = rigid_fit(neutral, positions)
    known = None if frames is None else np.full(MARKERS, frames)
    times = np.arange(len(positions)) / 30
    problem = SolveProblem(
        times, positions, FACE, MODEL, space, first, setup, least_noise=least_noise
    )
    return solve_pose_and_weights(problem, neutral_counts=known)


@pytest.mark.slow
@pytest.mark.parametrize("head", ["stabilised", "solve"])
def test_the_take_makes_good_for_a_noisy_neutral(head: HeadMode) -> None:
    """A sixth of the error of weights, of a neutral that is a single frame."""

    def error(frames: int | None) -> float:
        solved = (solve_measured(BUSY, frames, seed=seed, head=head) for seed in range(3))
        return float(np.mean([rms(joint.weights - BUSY) for joint in solved]))

    assert error(1) < 0.85 * error(None)


def test_an_exact_neutral_that_is_said_to_be_noisy_costs_nothing() -> None:
    corrected, plain = (solve_measured(BUSY, frames, exact=True) for frames in (1, None))
    assert rms(corrected.weights - BUSY) < 1.02 * rms(plain.weights - BUSY)


@pytest.mark.parametrize("frames", [5, 30])
def test_weights_that_mostly_rest_do_not_pass_for_an_error_of_the_neutral(frames: int) -> None:
    corrected, plain = (solve_measured(RARE, count, exact=True) for count in (frames, None))
    assert rms(corrected.weights - RARE) < 1.05 * rms(plain.weights - RARE)


def test_without_noise_there_is_nothing_to_correct() -> None:
    for head in ("stabilised", "solve"):
        joint = solve_measured(BUSY, 5, noise=0.0, head=head)  # type: ignore[arg-type]
        assert rms(joint.weights - BUSY) < 1e-6


def test_noise_that_a_take_states_is_no_sign_of_misfit() -> None:
    """More than its frames show: the difference is not noise that hides misfit."""
    joint = solve_measured(BUSY, None, exact=True, noise=1e-4, least_noise=5e-4)
    assert joint.regularisation.noise == 5e-4
    assert joint.regularisation.misfit < 1e-4


def solve_image(neutral_counts: np.ndarray | None) -> PoseAndWeights:
    names = tuple(f"m{i}" for i in range(MARKERS))
    setup = RetargetSetup(Binding(names, np.arange(MARKERS)), head="solve")
    image = 1000.0 * STILL[..., :2]
    image = image + 0.3 * np.random.default_rng(1).normal(size=image.shape)
    space = fit_map(image[0], FACE, MapOptions())
    first = Pose.identity(FRAMES)
    problem = SolveProblem(TIMES, image, FACE, MODEL, space, first, setup)
    return solve_pose_and_weights(problem, neutral_counts=neutral_counts)


def test_the_neutral_of_an_image_is_not_corrected() -> None:
    joint, plain = (solve_image(frames) for frames in (np.ones(MARKERS, np.int64), None))
    np.testing.assert_array_equal(joint.weights, plain.weights)


def test_occluded_markers_break_no_correction() -> None:
    positions = FACE + np.einsum("fs,smi->fmi", BUSY, BASIS)
    positions += 5e-4 * np.random.default_rng(1).normal(size=positions.shape)
    whole = solve_measured(BUSY, 1, positions=positions)
    hidden = positions.copy()
    hidden[20:50, :4] = hidden[70] = np.nan
    hidden[3:, 20] = np.nan
    joint = solve_measured(BUSY, 1, positions=hidden)
    assert np.isfinite(joint.weights).all()
    np.testing.assert_array_equal(np.isnan(joint.displaced), np.isnan(hidden))
    assert rms(joint.weights - BUSY) < 1.5 * rms(whole.weights - BUSY)


def test_a_short_gap_does_not_end_the_rounds_before_the_neutral_is_corrected() -> None:
    positions = FACE + np.einsum("fs,smi->fmi", BUSY, BASIS)
    positions += 5e-4 * np.random.default_rng(2).normal(size=positions.shape)
    whole = solve_measured(BUSY, 1, positions=positions, seed=2)
    positions[60:75, 4:14] = np.nan
    joint = solve_measured(BUSY, 1, positions=positions, seed=2)
    assert rms(joint.weights - BUSY) < 1.05 * rms(whole.weights - BUSY)


def test_the_correction_comes_on_top_of_where_the_map_starts() -> None:
    """A neutral that shows the first shape by a tenth, which the map is told."""
    shown = 0.1 * BASIS[0]
    positions = FACE - shown + np.einsum("fs,smi->fmi", BUSY, BASIS)
    positions += 5e-4 * np.random.default_rng(1).normal(size=positions.shape)
    joint = solve_measured(BUSY, 1, positions=positions, start=shown)
    level = solve_measured(BUSY, 1, positions=positions + shown)
    assert rms(joint.weights - level.weights) < 0.02 * rms(level.weights - BUSY)
