import numpy as np

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.options import SolveOptions
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.neutral_error import bootstrap_residual, neutral_correction
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import Iterate
from usdface.retarget.take_rows import TakeRows


def test_noise_holds_back_where_weights_cannot_fall_below_0() -> None:
    """Of two markers along one shape: at rest half of the noise is positive and fits a weight."""
    model = BlendShapeEvaluator(0.01 * np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 0.0]]))
    points = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    rows = TakeRows.of(MotionModel(points, model, 3, moving_head=False))
    held, times = Regularisation(1e-4, 0.0, SolveOptions(mode="frame")), np.arange(4000) / 30.0
    seen = np.ones((4000, 2), dtype=bool)
    solved = {weight: Iterate(np.full((4000, 1), weight)) for weight in (0.0, 0.5)}
    left = {
        weight: bootstrap_residual(rows, points, seen, times, held, iterate)[:, 1]
        for weight, iterate in solved.items()
    }
    # The mean of the negative half of a mean of two normal numbers of 0.1 mm.
    expected = -1e-4 / np.sqrt(2.0) / np.sqrt(2.0 * np.pi)
    np.testing.assert_allclose(left[0.0], expected, rtol=0.2)
    np.testing.assert_allclose(left[0.5], 0.0, atol=0.1 * abs(expected))
    assert not bootstrap_residual(rows, points, ~seen, times, held, solved[0.0]).any()


def test_the_mean_of_the_drawn_noise_is_no_residual() -> None:
    """Far from the bounds the ridge alone leaves a micrometre; the noise's mean is 20 of them."""
    model = BlendShapeEvaluator(0.01 * np.array([[0.0, 1.0, 0.0, 0.0, 1.0, 0.0]]))
    points = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    rows = TakeRows.of(MotionModel(points, model, 3, moving_head=False))
    held, times = Regularisation(1e-4, 0.0, SolveOptions(mode="frame")), np.arange(40) / 30.0
    iterate, seen = Iterate(np.full((40, 1), 0.5)), np.ones((40, 2), dtype=bool)
    left = bootstrap_residual(rows, points, seen, times, held, iterate)
    np.testing.assert_allclose(left, 0.0, atol=1.5e-6)


def test_the_residual_of_a_mirrored_face_is_mirrored() -> None:
    rng = np.random.default_rng(2)
    points, mirror = rng.normal(size=(6, 3)), np.array([-1.0, 1.0, 1.0])
    offsets = 0.01 * rng.normal(size=(3, 6, 3))
    times, seen = np.arange(40) / 30.0, rng.random((40, 6)) > 0.2
    held = Regularisation(1e-3, 0.0, SolveOptions())
    weights = np.clip(rng.normal(size=(40, 3)), 0.0, 1.0)
    found = []
    for side in (1.0, mirror):
        model = BlendShapeEvaluator((offsets * side).reshape(3, -1))
        rows = TakeRows.of(MotionModel(points * side, model, 3, moving_head=True))
        found.append(
            side * bootstrap_residual(rows, points * side, seen, times, held, Iterate(weights))
        )
    np.testing.assert_allclose(found[0], found[1], atol=1e-8 * np.abs(found[0]).max())


def test_rounding_does_not_exchange_the_noise_of_a_symmetric_face() -> None:
    """Left and right markers are as deep as each other, but for a rounding of 1e-9 m."""
    rng = np.random.default_rng(2)
    half = 0.05 * rng.normal(size=(4, 3))
    points = np.concatenate([half, half * [-1.0, 1.0, 1.0]])
    model = BlendShapeEvaluator(0.01 * rng.normal(size=(3, 24)))
    times, seen = np.arange(40) / 30.0, np.ones((40, 8), dtype=bool)
    held = Regularisation(1e-3, 0.0, SolveOptions())
    iterate = Iterate(np.clip(rng.normal(size=(40, 3)), 0.0, 1.0))
    found = []
    for rounding in (0.0, 1e-9, -1e-9):
        rounded = points + rounding * (np.arange(8) < 4)[:, None]
        rows = TakeRows.of(MotionModel(rounded, model, 3, moving_head=True))
        found.append(bootstrap_residual(rows, rounded, seen, times, held, iterate))
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], atol=1e-5 * np.abs(found[0]).max())


def test_a_correction_is_what_noise_and_misfit_leave_likely() -> None:
    """The posterior mean of each marker's error, without motions that the head may have made."""
    rng = np.random.default_rng(4)
    frames = np.array([1, 4, 30, 2, 0])
    seen = rng.random((40, 5)) > 0.3
    leftover = np.where(seen[..., None], 1e-4 * rng.normal(size=(40, 5, 3)), np.nan)
    held = Regularisation(3e-4, 4e-4, SolveOptions())
    before = 1e-4 * rng.normal(size=(5, 3))
    found = neutral_correction(before, leftover, seen, frames, held, np.zeros((15, 0)))
    prior = 3e-4**2 / np.maximum(frames, 1)
    lasting = max(0.0, 4e-4**2 - prior.mean())
    share = prior / (prior + 3e-4**2 / seen.sum(axis=0) + lasting)
    np.testing.assert_allclose(
        found, share[:, None] * (before - np.nanmean(leftover, axis=0)), rtol=1e-12
    )
    rigid = np.linalg.qr(rng.normal(size=(15, 6)))[0]
    without = neutral_correction(before, leftover, seen, frames, held, rigid)
    np.testing.assert_allclose(rigid.T @ without.ravel(), 0.0, atol=1e-18)
    np.testing.assert_allclose(without.ravel(), found.ravel() - rigid @ (rigid.T @ found.ravel()))


def test_a_marker_that_is_never_seen_and_a_take_without_noise_are_not_corrected() -> None:
    seen = np.ones((10, 4), dtype=bool)
    seen[:, 1] = False
    leftover = np.full((10, 4, 3), 1e-4)
    frames, none = np.full(4, 5), np.zeros((12, 0))
    noisy, exact = (Regularisation(noise, 0.0, SolveOptions()) for noise in (3e-4, 0.0))
    start = np.zeros((4, 3))
    found = neutral_correction(start, leftover, seen, frames, noisy, none)
    assert not found[1].any() and found[[0, 2, 3]].all()
    assert not neutral_correction(start, leftover, seen, frames, exact, none).any()
