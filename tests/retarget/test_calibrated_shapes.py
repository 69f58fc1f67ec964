import numpy as np

from usdface.blend_shapes.combination_weight import CombinationWeight
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath
from usdface.retarget.calibrated_shapes import performed
from usdface.setup.calibration import Calibration

SHAPES = np.array([[1.0, 0.0], [0.0, 2.0], [1.0, 1.0]])
NAMES = ("a", "b", "ab")


def test_a_performer_without_calibration_is_the_character() -> None:
    nothing = Calibration((), np.zeros(0), np.zeros(0))
    model, start = performed(BlendShapeEvaluator(SHAPES), NAMES, nothing)
    assert (model.offsets == SHAPES).all() and not start.any()


def test_gains_go_on_shapes_and_their_inbetweens_but_not_on_combinations() -> None:
    bent = InbetweenPath(
        0, np.array([0.0, 0.5, 1.0]), np.array([[0.0, 0.0], [0.9, 0.3], [1.0, 0.0]])
    )
    corner = CombinationWeight(2, np.array([0, 1]), least=False)
    model = BlendShapeEvaluator(SHAPES, (bent,), (corner,))
    calibration = Calibration(NAMES, np.array([1.5, 0.8, 2.0]), np.array([0.1, 0.0, 0.2]))
    found, start = performed(model, NAMES, calibration)
    alone = np.array([[0.5, 0.0, 0.0]])
    np.testing.assert_allclose(found.displacements(alone), 1.5 * model.displacements(alone))
    np.testing.assert_allclose(found.offsets, SHAPES * [[1.5], [0.8], [1.0]])
    np.testing.assert_allclose(start, 0.1 * SHAPES[0])


def test_what_was_taken_off_the_neutral_already_is_not_added_again() -> None:
    calibration = Calibration(("a", "b"), np.array([1.5, 0.8]), np.array([0.1, 0.2]))
    model, start = performed(BlendShapeEvaluator(SHAPES), NAMES, calibration, ("a",))
    np.testing.assert_allclose(start, 0.2 * SHAPES[1])
    np.testing.assert_allclose(model.offsets, SHAPES * [[1.5], [0.8], [1.0]])
