import numpy as np
import pytest

from usdface.retarget.motion_model import MotionModel

RNG = np.random.default_rng(5)
POINTS, OFFSETS = RNG.normal(size=(7, 3)), RNG.normal(size=(2, 7, 3))


@pytest.mark.parametrize("axes", [2, 3])
def test_coordinates_are_those_that_are_seen(axes: int) -> None:
    motion = MotionModel.linear(POINTS, OFFSETS, axes, False)
    seen = motion.shapes.offsets[:, motion.coordinates]
    np.testing.assert_array_equal(seen, OFFSETS[..., :axes].reshape(2, -1))


def test_a_translation_is_a_motion_of_the_head_whatever_the_errors() -> None:
    motion, moved = MotionModel.linear(POINTS, OFFSETS, 3, True), np.tile([0.1, -0.2, 0.3], 7)
    errors = RNG.uniform(0.5, 2.0, 7)
    for own, each in ((None, 1.0), (errors, np.repeat(errors, 3))):
        basis = motion.head_basis(own)
        np.testing.assert_allclose(basis.T @ basis, np.eye(6), atol=1e-12)
        np.testing.assert_allclose(basis @ (basis.T @ (moved / each)), moved / each, atol=1e-12)


def test_a_head_that_is_known_has_no_motion() -> None:
    assert MotionModel.linear(POINTS, OFFSETS, 2, False).head_basis().shape == (14, 0)
