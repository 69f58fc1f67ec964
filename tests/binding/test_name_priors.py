from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.binding.face_surface import face_surface
from usdface.binding.landmarks import FaceLandmarks, find_landmarks
from usdface.binding.name_priors import name_errors, name_priors, named_heights, named_pose
from usdface.io.usd.rig import read_rig

HEAD = Path(__file__).resolve().parents[2] / "examples" / "head.usdc"
NAMES = ("nose_tip", "chin", "brow_l", "brow_r", "lip_corner_l", "lip_corner_r", "x", "cheek1")


@pytest.fixture(scope="module")
def landmarks() -> FaceLandmarks:
    found = find_landmarks(face_surface(read_rig(HEAD)[0].face()))
    assert found is not None
    return found


def test_names_say_what_is_above_what() -> None:
    names = ("ForeHead_M", "Reye_Up", "browOut", "LIP_LOW", "chin.1", "nosetip", "x")
    heights = named_heights(names)
    order = np.argsort(heights[:-1])
    assert [names[i] for i in order] == [
        "chin.1", "LIP_LOW", "nosetip", "Reye_Up", "browOut", "ForeHead_M",
    ]  # fmt: skip
    assert np.isnan(heights[-1])


@pytest.mark.parametrize(
    "names", [("m1", "m2"), ("nose", "chin", "m3"), tuple(f"lip{i}" for i in range(9))]
)
def test_few_names_say_nothing(names: tuple[str, ...], landmarks: FaceLandmarks) -> None:
    assert np.isnan(named_heights(names)).all()
    assert name_priors(names, landmarks) is None


def test_places_lie_on_the_side_that_names_tell(landmarks: FaceLandmarks) -> None:
    priors = name_priors(NAMES, landmarks)
    assert priors is not None
    assert priors.known.tolist() == [True] * 6 + [False, True]
    np.testing.assert_array_equal(np.sign(priors.points[2:6, 0, 0]), priors.sides[2:6])
    mirrored = priors.mirrored()
    np.testing.assert_allclose(mirrored.points[2:6:2], priors.points[3:6:2], atol=0.004)
    np.testing.assert_array_equal(mirrored.points[0], priors.points[0])
    np.testing.assert_allclose(mirrored.mirrored().points, priors.points, atol=1e-12)


def test_errors_are_least_at_the_place_and_count_from_any_of_several(
    landmarks: FaceLandmarks,
) -> None:
    priors = name_priors(NAMES, landmarks)
    assert priors is not None
    errors = name_errors(priors, priors.points[:, 0])
    np.testing.assert_allclose(np.diagonal(errors)[:6], 0.0, atol=1e-12)
    assert (errors[6] == 0.0).all()
    both = name_errors(priors, priors.points[7])
    np.testing.assert_allclose(both[7], 0.0, atol=1e-12)


def test_the_pose_of_markers_on_their_places_is_found(landmarks: FaceLandmarks) -> None:
    priors = name_priors(NAMES, landmarks)
    assert priors is not None
    turn = Rotation.from_rotvec([0.4, -1.9, 0.7]).as_matrix()
    neutral = (np.nan_to_num(priors.points[:, 0]) - [0.1, 1.0, -2.0]) @ turn / 1.3
    pose = named_pose(neutral, priors)
    np.testing.assert_allclose(pose.linear, 1.3 * turn.T, atol=1e-6)
    assert pose.squared.max() < 1e-9


def test_one_wrong_name_does_not_turn_the_face(landmarks: FaceLandmarks) -> None:
    names = (*NAMES, "forehead_l", "forehead_r", "cheek_l", "cheek_r", "lid_l", "lid_r")
    priors = name_priors(names, landmarks)
    assert priors is not None
    neutral = np.array(priors.points[:, 0])
    neutral[6] = 0.0
    neutral[0], neutral[1] = neutral[1], neutral[0].copy()
    pose = named_pose(neutral, priors)
    assert np.linalg.norm(pose.linear - np.eye(3)) < 0.1
    assert pose.squared[[0, 1]].min() > 16 > 1 > np.delete(pose.squared, [0, 1]).max()
