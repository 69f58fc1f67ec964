"""Features of a face at weights of its blend shapes."""

import numpy as np

from usdface.blend_shapes.combination_weight import CombinationWeight
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.rule_design.face_motions import FaceMotions
from usdface.rule_design.movements import Movements


def test_features_are_those_of_weights_with_their_combinations() -> None:
    offsets = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    both = CombinationWeight(2, np.array([0, 1]), least=False)
    none = np.zeros((0, 3))
    motions = FaceMotions(
        BlendShapeEvaluator(offsets, combinations=(both,)),
        np.zeros(3, bool),
        np.arange(3),
        np.eye(3),
        Movements(none, none, none),
    )
    found = motions.features(np.array([[1.0, 0.5, 0.0], [1.0, 0.0, 1.0]]))
    np.testing.assert_allclose(found, [[1.0, 0.5, 0.5], [1.0, 0.0, 0.0]])
    assert not motions.poses.flags.writeable
