import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.retarget.neutral import neutral_markers, on_plane

RNG = np.random.default_rng(7)
FACE = RNG.normal(size=(10, 3))


def test_a_still_face_is_its_own_neutral_however_the_head_moves() -> None:
    turns = Rotation.from_rotvec(RNG.normal(size=(20, 3)) * 0.1)
    take = np.einsum("fij,mj->fmi", turns.as_matrix(), FACE) + RNG.normal(size=(20, 1, 3))
    neutral = neutral_markers(take, (0, 19))
    np.testing.assert_allclose(neutral, take[0], atol=1e-12)


def test_noise_averages_out() -> None:
    take = FACE + 0.01 * RNG.normal(size=(400, 10, 3))
    assert np.abs(neutral_markers(take, (0, 399)) - FACE).max() < 0.01


def test_a_marker_is_averaged_over_the_frames_that_show_it() -> None:
    take = np.tile(FACE, (5, 1, 1))
    take[1:, 0], take[:, 1] = np.nan, np.nan
    neutral = neutral_markers(take, (0, 4))
    np.testing.assert_allclose(neutral[0], FACE[0], atol=1e-12)
    assert np.isnan(neutral[1]).all()


def test_image_markers_stay_in_the_image() -> None:
    image = np.tile(FACE[:, :2], (4, 1, 1))
    np.testing.assert_allclose(neutral_markers(image, (1, 3)), FACE[:, :2], atol=1e-12)
    flat = on_plane(image)
    assert flat.shape == (4, 10, 3) and not flat[..., 2].any()


@pytest.mark.parametrize("frames", [(-1, 2), (3, 2), (0, 5)])
def test_neutral_frames_lie_in_the_take(frames: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="frames 0 to 4"):
        neutral_markers(np.tile(FACE, (5, 1, 1)), frames)
