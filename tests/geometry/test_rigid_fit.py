import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import SolveError
from usdface.geometry.rigid_fit import Pose, mean_scale, rigid_fit, similarity_fit

RNG = np.random.default_rng(1)


def random_pose(count: int) -> Pose:
    turns = Rotation.from_rotvec(np.random.default_rng(3).normal(size=(count, 3)))
    return Pose(turns.as_matrix(), RNG.normal(size=(count, 3)))


def test_rigid_fit_finds_any_motion() -> None:
    face, pose = RNG.normal(size=(9, 3)), random_pose(20)
    fitted, usable = rigid_fit(face, pose.to_take(np.tile(face, (20, 1, 1))))
    assert usable.all()
    np.testing.assert_allclose(fitted.rotations, pose.rotations, atol=1e-12)
    np.testing.assert_allclose(fitted.translations, pose.translations, atol=1e-12)


def test_to_head_undoes_to_take() -> None:
    pose, positions = random_pose(5), RNG.normal(size=(5, 4, 3))
    np.testing.assert_allclose(pose.to_head(pose.to_take(positions)), positions, atol=1e-12)


def test_a_hidden_marker_does_not_move_the_fit() -> None:
    face, pose = RNG.normal(size=(9, 3)), random_pose(6)
    target = pose.to_take(np.tile(face, (6, 1, 1)))
    target[:, 2] = np.nan
    fitted, _ = rigid_fit(face, target)
    np.testing.assert_allclose(fitted.rotations, pose.rotations, atol=1e-12)


def test_a_marker_of_twice_the_weight_counts_as_two() -> None:
    face, target = RNG.normal(size=(9, 3)), RNG.normal(size=(6, 9, 3))
    target[2, 4] = np.nan
    counts = RNG.integers(1, 4, 9)
    fitted, _ = rigid_fit(face, target, counts.astype(float))
    repeated, _ = rigid_fit(np.repeat(face, counts, axis=0), np.repeat(target, counts, axis=1))
    np.testing.assert_allclose(fitted.rotations, repeated.rotations, atol=1e-12)
    np.testing.assert_allclose(fitted.translations, repeated.translations, atol=1e-12)


def test_rotations_are_proper_even_for_a_flat_face() -> None:
    face = RNG.normal(size=(7, 3)) * [1, 1, 0]
    fitted, _ = rigid_fit(face, RNG.normal(size=(30, 7, 3)))
    np.testing.assert_allclose(np.linalg.det(fitted.rotations), 1.0, atol=1e-12)


def test_frames_without_three_markers_keep_the_nearest_pose() -> None:
    face, pose = RNG.normal(size=(5, 3)), random_pose(7)
    target = pose.to_take(np.tile(face, (7, 1, 1)))
    target[1:5, :3] = np.nan  # two markers left in frames 1 to 4
    fitted, usable = rigid_fit(face, target)
    assert usable.tolist() == [True, False, False, False, False, True, True]
    nearest = [0, 0, 0, 5, 5, 5, 6]
    np.testing.assert_allclose(fitted.rotations, pose.rotations[nearest], atol=1e-12)


def test_markers_in_a_line_leave_a_turn_open_and_keep_the_nearest_pose() -> None:
    face, pose = RNG.normal(size=(6, 3)), random_pose(5)
    face[:3] = [[0.0, 1.0, 0.0], [0.0, 2.0, 0.01], [0.0, 3.0, 0.0]]
    target = pose.to_take(np.tile(face, (5, 1, 1)))
    target[1:3, 3:] = np.nan
    fitted, usable = rigid_fit(face, target)
    assert usable.tolist() == [True, False, False, True, True]
    np.testing.assert_allclose(fitted.rotations, pose.rotations[[0, 0, 3, 3, 4]], atol=1e-12)
    _, usable = rigid_fit(face[:3], target[:, :3])
    assert usable.all()  # no frame shows others


def test_a_take_without_three_markers_is_refused() -> None:
    with pytest.raises(SolveError, match="three head markers"):
        rigid_fit(RNG.normal(size=(2, 3)), RNG.normal(size=(4, 2, 3)))


def test_similarity_fit_finds_scale_rotation_and_offset() -> None:
    face = RNG.normal(size=(8, 3))
    linear = 2.5 * Rotation.from_rotvec([1.2, -0.7, 2.1]).as_matrix().T
    fitted, offset = similarity_fit(face, face @ linear + [1, 2, 3])
    np.testing.assert_allclose(fitted, linear, atol=1e-12)
    np.testing.assert_allclose(offset, [1, 2, 3], atol=1e-12)


def test_the_mean_scale_of_a_mirrored_stretch_is_the_root_of_its_volume() -> None:
    turned = Rotation.from_euler("xyz", (10, 20, 30), degrees=True).as_matrix()
    assert mean_scale(turned @ np.diag([-1.0, 2.0, 4.0])) == pytest.approx(2.0)


def test_the_pose_of_some_frames_is_theirs() -> None:
    rotations = Rotation.random(5, rng=3).as_matrix()
    some = Pose(rotations, np.arange(15.0).reshape(5, 3)).at(np.array([4, 1]))
    assert np.array_equal(some.rotations, rotations[[4, 1]])
    assert some.translations.tolist() == [[12, 13, 14], [3, 4, 5]]
