import numpy as np
import pytest
from filmed import COUNT, FACE, WORLD, turning

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.inbetween_path import InbetweenPath
from usdface.retarget.unseen_shapes import unseen_shapes, without_shapes
from usdface.retarget.views import Views

ALONG = np.zeros((3, len(FACE), 3))
ALONG[0, 3:9, 1] = 0.01  # up
ALONG[1, 3:9, 2] = 0.01  # forwards


def views(degrees: float) -> Views:
    slopes = np.repeat(turning(degrees).rotations[:, None, :2], len(FACE), axis=1)
    return Views(WORLD.take.names, slopes, np.ones((COUNT, len(FACE))))


def test_a_shape_that_moves_no_marker_is_unseen() -> None:
    assert unseen_shapes(ALONG).tolist() == [False, False, True]
    assert unseen_shapes(ALONG[..., :2]).tolist() == [False, True, True]


@pytest.mark.parametrize(("degrees", "unseen"), [(0.0, True), (5.0, True), (25.0, False)])
def test_a_head_that_turns_shows_what_comes_forward(degrees: float, unseen: bool) -> None:
    assert unseen_shapes(ALONG, views(degrees)).tolist() == [False, unseen, True]


def test_shapes_that_are_left_out_move_nothing() -> None:
    knots = np.outer([0.0, 0.8, 1.0], np.ones(4))
    paths = tuple(InbetweenPath(k, np.array([0.0, 0.5, 1.0]), knots) for k in range(2))
    model = without_shapes(BlendShapeEvaluator(np.ones((2, 4)), paths), np.array([True, False]))
    assert not model.displacements(np.array([[0.7, 0.0]])).any()
    assert model.inbetweens[1].displacements.any()
