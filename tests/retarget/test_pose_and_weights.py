import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.options import HeadMode, MapOptions
from usdface.retarget.pose_and_weights import PoseAndWeights, solve_pose_and_weights
from usdface.retarget.rbf import fit_map
from usdface.retarget_setup import Binding, RetargetSetup

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
    return solve_pose_and_weights(TIMES, positions, FACE, MODEL, space, first, setup)


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
