from dataclasses import replace

import numpy as np
import pytest

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath
from usdface.options import SolveOptions
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.bounds import Bounds
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.take_rows import TakeRows

RNG = np.random.default_rng(3)
TARGET = RNG.normal(size=(12, 3))
MODEL = BlendShapeEvaluator(0.1 * RNG.normal(size=(4, 36)))
TIMES = np.arange(6) / 30.0
EXACT = Regularisation(0.0, 0.0, SolveOptions(mode="frame"))


@pytest.mark.parametrize("axes", [2, 3])
def test_small_motions_of_the_head_change_no_weight(axes: int) -> None:
    rows = TakeRows.of(MotionModel(TARGET, MODEL, axes, moving_head=True))
    weights = RNG.uniform(0.1, 0.9, (6, 4))
    shown = rows.displacements(weights)
    motion = RNG.normal(size=(6, rows.rigid.shape[1])) @ rows.rigid.T
    for observed in (shown, shown + motion):
        normal, right = rows.equations(observed)
        np.testing.assert_allclose(right @ np.linalg.inv(normal), weights, atol=1e-12)
        found = rows.solve(observed, TIMES, EXACT, None, Bounds())
        np.testing.assert_allclose(found.weights, weights, atol=1e-6)


def test_a_head_that_is_known_does_not_move() -> None:
    rows = TakeRows.of(MotionModel(TARGET, MODEL, 3, moving_head=False))
    assert rows.rigid.shape == (36, 0)
    normal, _ = rows.equations(np.zeros((1, 36)))
    np.testing.assert_allclose(normal, MODEL.offsets @ MODEL.offsets.T)


def test_an_image_has_no_say_on_depth() -> None:
    rows = TakeRows.of(MotionModel(TARGET, MODEL, 2, moving_head=False))
    kept = MODEL.offsets.reshape(4, 12, 3)[..., :2].reshape(4, 24)
    np.testing.assert_array_equal(rows.model.offsets, kept)


@pytest.mark.parametrize("moving_head", [False, True])
@pytest.mark.parametrize("axes", [2, 3])
def test_squares_count_by_the_inverse_variances_of_the_markers(
    axes: int, moving_head: bool
) -> None:
    """The estimate of Aitken (1936), with the head's motion as further unknowns."""
    errors = RNG.uniform(0.2, 5.0, 12)
    rows = TakeRows.of(MotionModel(TARGET, MODEL, axes, moving_head), errors)
    observed = RNG.normal(size=(6, 12 * axes))
    normal, right = rows.equations(observed)
    each = np.repeat(errors, axes)[:, None]
    unknown = np.hstack([rows.model.offsets.T, rows.rigid]) / each
    expected = np.linalg.lstsq(unknown, observed.T / each, rcond=None)[0].T
    np.testing.assert_allclose(right @ np.linalg.inv(normal), expected[:, :4], atol=1e-10)
    left = observed - expected[:, :4] @ rows.model.offsets
    motion = expected[:, 4:] @ rows.rigid.T
    np.testing.assert_allclose(rows.rigid_part(left), motion, atol=1e-10)


def test_equal_errors_count_alike() -> None:
    assert TakeRows.of(MotionModel(TARGET, MODEL, 3, True)).marker_weights is None
    rows = TakeRows.of(MotionModel(TARGET, MODEL, 3, True), np.linspace(0.5, 2.0, 12))
    np.testing.assert_allclose(rows.marker_weights, np.linspace(0.5, 2.0, 12) ** -2.0)


def test_shapes_with_inbetweens_are_solved_by_the_same_weights() -> None:
    """A path that is straight solves as its shape does."""
    errors = RNG.uniform(0.2, 5.0, 12)
    half = np.stack([np.zeros(36), 0.5 * MODEL.offsets[0], MODEL.offsets[0]])
    path = InbetweenPath(0, np.array([0.0, 0.5, 1.0]), half)
    curved = replace(MODEL, inbetweens=(path,))
    truth = RNG.uniform(0.1, 0.9, (6, 4))
    observed = MODEL.displacements(truth) + 0.02 * RNG.normal(size=(6, 36))
    found = [
        TakeRows.of(MotionModel(TARGET, model, 3, False), errors)
        .solve(observed, TIMES, EXACT, None, Bounds())
        .weights
        for model in (MODEL, curved)
    ]
    np.testing.assert_allclose(found[1], found[0], atol=1e-5)
