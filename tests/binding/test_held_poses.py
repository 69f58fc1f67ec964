import numpy as np
import pytest
from resting_faces import TIMES, breathing

from usdface.binding.held_poses import held_poses
from usdface.binding.neutral_frames import distant_frames
from usdface.binding.stabilised_take import stabilised_take


def test_the_face_rests_where_it_stays() -> None:
    positions = breathing(slice(40, 60))
    first, last = held_poses(stabilised_take(positions), TIMES, 1)[0].frames
    assert 40 <= first <= last < 60 and last - first >= 10


def test_a_face_that_never_moves_rests_throughout() -> None:
    positions = np.repeat(breathing(slice(0, 1))[:1], len(TIMES), axis=0)
    stabilised = stabilised_take(positions)
    rest = held_poses(stabilised, TIMES, 1)[0].frames
    assert rest[0] == 0 or rest[1] == len(TIMES) - 1 or rest[1] > rest[0]
    assert len(distant_frames(stabilised, rest)) == 0


@pytest.mark.parametrize("hidden", [slice(0, 20), slice(70, 100), slice(100, 120)])
def test_frames_without_markers_are_neither_rest_nor_peak(hidden: slice) -> None:
    positions = breathing(slice(40, 60))
    positions[hidden, 2:] = np.nan  # two markers are no pose
    stabilised = stabilised_take(positions)
    first, last = held_poses(stabilised, TIMES, 1)[0].frames
    assert 40 <= first <= last < 60
    unseen = set(range(120)[hidden])
    held = held_poses(stabilised, TIMES)
    assert all(not unseen & {*pose.frames} and np.isfinite(pose.likely) for pose in held)
    assert not unseen & set(distant_frames(stabilised, (first, last)).tolist())


def test_a_held_pose_knows_how_usual_it_is_and_whether_the_take_begins_with_it() -> None:
    positions = breathing(slice(0, 30))
    pose = held_poses(stabilised_take(positions), TIMES, 1)[0]
    assert pose.frames[1] < 30
    assert 0.25 < pose.usual < 0.5  # a little more than the frames in which it rests
    assert pose.first > 0.9
    later = held_poses(stabilised_take(positions[::-1]), TIMES, 1)[0]
    assert later.usual == pytest.approx(pose.usual, rel=0.05)
    assert later.first < 0.1


@pytest.mark.parametrize("still", [True, False])
def test_a_take_that_begins_still_has_its_beginning_among_few_candidates(still: bool) -> None:
    """For a third of a second; then a pose is held for a whole one."""
    positions = breathing(slice(60, 90))
    if still:
        positions[:10] = positions[0]
    first = held_poses(stabilised_take(positions), TIMES, 1)[0].frames
    assert first[1] < 12 if still else 60 <= first[0] <= first[1] < 90


def blinking(blinks: dict[int, int], seconds: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """Forty markers of which two blink, over a jaw that opens wide and rests in between, 60 Hz."""
    rng = np.random.default_rng(2)
    times = np.arange(round(60 * seconds)) / 60.0
    positions = 0.05 * rng.normal(size=(40, 3)) + 2e-5 * rng.normal(size=(len(times), 40, 3))
    jaw = np.clip(np.sin(np.pi * times) ** 4 - 0.2, 0.0, None)
    positions[:, :12, 1] -= 0.03 * jaw[:, None]
    for frame, length in blinks.items():
        lids = np.hanning(length)[:, None]
        positions[frame : frame + length, 38:, 1] -= 0.005 * lids
    return positions, times


@pytest.mark.parametrize("hidden", [False, True])
def test_a_blink_is_no_part_of_a_rest(hidden: bool) -> None:
    blinks = {frame: 16 for frame in (50, 112, 171, 233, 290, 352, 411)}
    positions, times = blinking(blinks)
    if hidden:
        positions[::2, 38] = np.nan
        positions[:, 20] = np.nan  # never seen
        positions[0, 20] = 0.0
    found = held_poses(stabilised_take(positions), times)[0].frames
    shut = np.zeros(len(times), dtype=bool)
    for frame, length in blinks.items():
        shut[frame + 3 : frame + length - 3] = True
    assert not shut[found[0] : found[1] + 1].any()
    assert found[1] - found[0] >= 8


def test_a_wrong_label_in_a_frame_does_not_cut_a_rest() -> None:
    positions, times = blinking({})
    whole = held_poses(stabilised_take(positions), times)[0].frames
    positions[sum(whole) // 2, 5] += 0.02
    assert held_poses(stabilised_take(positions), times)[0].frames == whole
