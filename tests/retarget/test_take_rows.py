import numpy as np
import pytest

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.options import SolveOptions
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
    rows = TakeRows.of(TARGET, MODEL, axes, moving_head=True)
    weights = RNG.uniform(0.1, 0.9, (6, 4))
    shown = rows.displacements(weights)
    motion = RNG.normal(size=(6, rows.rigid.shape[1])) @ rows.rigid.T
    for observed in (shown, shown + motion):
        normal, right = rows.equations(observed)
        np.testing.assert_allclose(right @ np.linalg.inv(normal), weights, atol=1e-12)
        found = rows.solve(observed, TIMES, EXACT, None, Bounds())
        np.testing.assert_allclose(found.weights, weights, atol=1e-6)


def test_a_head_that_is_known_does_not_move() -> None:
    rows = TakeRows.of(TARGET, MODEL, 3, moving_head=False)
    assert rows.rigid.shape == (36, 0)
    normal, _ = rows.equations(np.zeros((1, 36)))
    np.testing.assert_allclose(normal, MODEL.offsets @ MODEL.offsets.T)


def test_an_image_has_no_say_on_depth() -> None:
    rows = TakeRows.of(TARGET, MODEL, 2, moving_head=False)
    kept = MODEL.offsets.reshape(4, 12, 3)[..., :2].reshape(4, 24)
    np.testing.assert_array_equal(rows.model.offsets, kept)
