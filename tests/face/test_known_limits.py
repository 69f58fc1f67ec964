import numpy as np

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.known_limits import with_known_limits


def test_a_known_limit_is_found_in_any_spelling() -> None:
    model = BlendShapeEvaluator(np.ones((3, 6)))
    found = with_known_limits(model, ("JawOpen", "smile", "mouth_close"))
    assert found.limits.tolist() == [[2, 0]]
    assert with_known_limits(found, ("JawOpen", "smile", "mouth_close")).limits.tolist() == [[2, 0]]
    assert not len(with_known_limits(model, ("jawOpen", "a", "b")).limits)
