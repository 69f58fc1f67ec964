import numpy as np
from resting_faces import TIMES, breathing

from usdface.binding.held_poses import held_poses
from usdface.binding.neutral_frames import distant_frames
from usdface.binding.stabilised_take import stabilised_take


def test_peaks_are_far_from_rest_and_from_each_other() -> None:
    positions = breathing(slice(40, 60))
    stabilised = stabilised_take(positions)
    rest = held_poses(stabilised, TIMES, 1)[0].frames
    peaks = distant_frames(stabilised, rest)[:4]
    scores = stabilised.scores
    far = np.linalg.norm(scores - scores[rest[0]], axis=1)
    assert far[peaks[0]] == far.max()
    assert not set(peaks.tolist()) & set(range(42, 58))
