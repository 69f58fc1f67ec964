from dataclasses import replace

import numpy as np
import pytest
from filmed import CAMERA, COUNT, FOCAL, SIZE, WORLD, filmed, found, placed

from usdface.geometry.rigid_fit import Pose


def test_a_turning_head_shows_the_focal_length() -> None:
    take, _ = filmed(WORLD, 20.0)
    head, codes = found(take)
    assert codes == ["FOCAL_LENGTH_FOUND"]
    assert head.camera.focal_length == pytest.approx(FOCAL, rel=0.15)


def test_without_its_size_an_image_is_taken_to_be_centred_on_the_face() -> None:
    take, _ = filmed(WORLD, 20.0)
    head, codes = found(replace(take, image_size=None, focal_length=FOCAL))
    assert codes == ["IMAGE_SIZE_ASSUMED"]
    np.testing.assert_allclose(head.camera.centre, np.mean(take.positions[0], axis=0))


def test_a_head_that_rests_does_not_show_it() -> None:
    still = placed(Pose(np.tile(np.eye(3), (COUNT, 1, 1)), np.zeros((COUNT, 3))))
    image = CAMERA.image(still.to_take(WORLD.take.positions))
    image += np.random.default_rng(6).normal(scale=0.3, size=image.shape)
    head, codes = found(replace(WORLD.take, positions=image, image_size=SIZE))
    assert codes == ["FOCAL_LENGTH_ASSUMED"]
    assert head.camera.focal_length == pytest.approx(0.65 * np.hypot(*SIZE))


def test_a_single_image_does_not_show_it() -> None:
    """All focal lengths explain it but for rounding."""
    take, _ = filmed(WORLD, 20.0)
    _, codes = found(replace(take, times=take.times[:1], positions=take.positions[:1]))
    assert codes == ["FOCAL_LENGTH_ASSUMED"]
