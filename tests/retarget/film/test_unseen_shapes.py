import numpy as np

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath
from usdface.retarget.film.unseen_shapes import unseen_shapes, without_shapes

ALONG = np.zeros((3, 12, 3))
ALONG[0, 3:9, 1] = 0.01  # up
ALONG[1, 3:9, 2] = 0.01  # forwards


def test_a_shape_that_moves_no_marker_is_unobservable() -> None:
    assert unseen_shapes(ALONG).tolist() == [False, False, True]
    assert unseen_shapes(ALONG[..., :2]).tolist() == [False, True, True]


def test_shapes_that_are_left_out_move_nothing() -> None:
    knots = np.outer([0.0, 0.8, 1.0], np.ones(4))
    paths = tuple(InbetweenPath(k, np.array([0.0, 0.5, 1.0]), knots) for k in range(2))
    model = without_shapes(BlendShapeEvaluator(np.ones((2, 4)), paths), np.array([True, False]))
    assert not model.displacements(np.array([[0.7, 0.0]])).any()
    assert model.inbetweens[1].displacements.any()
