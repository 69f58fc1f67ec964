import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.retarget.neutral import neutral_markers, on_plane, resting_frames

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


def blinking(noise: float = 0.0, moved: int = 3) -> np.ndarray:
    """30 neutral frames; in frames 10 to 15 some markers of ten move by a tenth of the face."""
    take = FACE + noise * RNG.normal(size=(30, 10, 3))
    take[10:16, :moved, 1] -= 0.1
    return take


def test_frames_in_which_the_face_moves_are_left_out() -> None:
    resting = resting_frames(blinking(0.01), (0, 29))
    assert np.flatnonzero(~resting).tolist() == list(range(10, 16))
    np.testing.assert_allclose(neutral_markers(blinking(), (0, 29)), FACE, atol=1e-12)
    # Seen from the fifth frame on, they are frames 5 to 10 of the range.
    assert np.flatnonzero(~resting_frames(blinking(0.01), (5, 29))).tolist() == list(range(5, 11))


def test_neither_noise_nor_a_slow_change_moves_the_face() -> None:
    assert resting_frames(FACE + 0.01 * RNG.normal(size=(60, 10, 3)), (0, 59)).all()
    assert resting_frames(FACE[:4] + 0.01 * RNG.normal(size=(60, 4, 3)), (0, 59)).all()
    drift = np.linspace(0, 0.01, 60)[:, None, None] * RNG.normal(size=(10, 3))
    assert resting_frames(FACE + drift, (0, 59)).all()


def test_a_head_that_turns_before_a_camera_leaves_no_frame_out() -> None:
    turns = Rotation.from_rotvec(np.linspace(0, 0.5, 30)[:, None] ** 2 * [0, 1, 0]).as_matrix()
    image = np.einsum("fij,mj->fmi", turns, FACE)[..., :2]
    assert resting_frames(image, (0, 29)).all()


def test_hidden_markers_and_few_frames_leave_none_out() -> None:
    hidden = blinking()
    hidden[10:16, :3], hidden[:, 9] = np.nan, np.nan
    assert resting_frames(hidden, (0, 29)).all()
    assert resting_frames(blinking(), (13, 16)).all()
    assert resting_frames(np.full((30, 10, 3), np.nan), (0, 29)).all()


def test_image_markers_stay_in_the_image() -> None:
    image = np.tile(FACE[:, :2], (4, 1, 1))
    np.testing.assert_allclose(neutral_markers(image, (1, 3)), FACE[:, :2], atol=1e-12)
    flat = on_plane(image)
    assert flat.shape == (4, 10, 3) and not flat[..., 2].any()


@pytest.mark.parametrize(
    ("frames", "said"),
    [((-1, 2), "frames 0 to 4"), ((3, 2), "3 to 2 are reversed"), ((0, 5), "frames 0 to 4")],
)
def test_neutral_frames_lie_in_the_take(frames: tuple[int, int], said: str) -> None:
    with pytest.raises(InputError, match=said):
        neutral_markers(np.tile(FACE, (5, 1, 1)), frames)


@pytest.mark.parametrize("start", [0, 8])
def test_the_pose_of_the_neutral_is_that_of_a_resting_frame(start: int) -> None:
    """Wherever the face moves, also in the frame that would be the reference of the pose."""
    take = np.tile(FACE, (20, 1, 1))
    take[start : start + 4, :6, 1] -= 0.3
    np.testing.assert_allclose(neutral_markers(take, (0, 19)), FACE, atol=1e-9)


def test_blank_frames_tell_nothing_of_the_others() -> None:
    take = FACE + 0.03 * RNG.normal(size=(20, 10, 3))
    take[4:15] = np.nan
    assert resting_frames(take, (0, 19)).all()


def test_a_marker_that_only_moving_frames_show_has_their_neutral() -> None:
    take = blinking()
    take[:10, 9], take[16:, 9] = np.nan, np.nan
    np.testing.assert_allclose(neutral_markers(take, (0, 29)), FACE, atol=0.05)
