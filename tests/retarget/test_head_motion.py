import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.retarget.head_motion import head_motion, smooth_motion, turned_at_neutral

RNG = np.random.default_rng(4)
TIMES = np.arange(400) / 60
FACE = 0.06 * RNG.normal(size=(30, 3)) + [0.0, 1.5, 0.1]
ALL = np.ones((len(TIMES), len(FACE)), dtype=bool)
SWING = 0.15 * np.sin(np.outer(TIMES, [1.1, 0.7, 0.9]))
TURN = Rotation.from_rotvec(SWING)
POSE = Pose(
    TURN.as_matrix(),
    FACE.mean(axis=0) - TURN.apply(FACE.mean(axis=0)) + 0.02 * np.sin(np.outer(TIMES, [1, 2, 3])),
)


def test_an_equal_character_moves_as_the_performer() -> None:
    moved = head_motion(POSE, TIMES, FACE, FACE, 0.0, ALL)
    np.testing.assert_allclose(moved.rotations, POSE.rotations, atol=1e-9)
    np.testing.assert_allclose(moved.translations, POSE.translations, atol=1e-9)


def test_the_motion_is_carried_over_in_size_and_place() -> None:
    """Moving and carrying over change places, whatever the similarity."""
    to_character = 2.5 * Rotation.from_rotvec([0.3, 1.2, -0.4]).as_matrix().T
    character = FACE @ to_character + [3.0, -1.0, 2.0]
    moved = head_motion(POSE, TIMES, FACE, character, 0.0, ALL)
    performed = POSE.to_take(np.broadcast_to(FACE, (len(TIMES), *FACE.shape)))
    ours = moved.to_take(np.broadcast_to(character, (len(TIMES), *character.shape)))
    np.testing.assert_allclose(ours, performed @ to_character + [3.0, -1.0, 2.0], atol=1e-9)
    identity = moved.rotations @ moved.rotations.transpose(0, 2, 1)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-12)


@pytest.mark.parametrize("noise", [3e-4, 3e-3])
def test_smoothing_brings_a_noisy_pose_nearer_to_the_truth(noise: float) -> None:
    clean = POSE.to_take(np.broadcast_to(FACE, (len(TIMES), *FACE.shape)))
    fitted, _ = rigid_fit(FACE, clean + noise * RNG.normal(size=clean.shape))

    def off(pose: Pose) -> float:
        moved = pose.to_take(np.broadcast_to(FACE, clean.shape))
        return float(np.sqrt(np.mean((moved - clean) ** 2)))

    assert off(smooth_motion(fitted, TIMES, FACE, noise, ALL)) < 0.6 * off(fitted)


def test_a_head_that_rests_is_held_still() -> None:
    resting = np.broadcast_to(FACE, (len(TIMES), *FACE.shape))
    fitted, _ = rigid_fit(FACE, resting + 1e-3 * RNG.normal(size=resting.shape))
    smooth = smooth_motion(fitted, TIMES, FACE, 1e-3, ALL)

    def jitter(pose: Pose) -> float:
        return float(np.abs(np.diff(pose.to_take(resting), 2, axis=0)).max())

    assert jitter(smooth) < 0.01 * jitter(fitted)


@pytest.mark.parametrize("degrees", [0.0, 15.0])
def test_a_head_that_is_turned_at_neutral_is_reported(degrees: float) -> None:
    nods = Rotation.from_euler("x", 3.0 * np.sin(TIMES)[:, None], degrees=True)
    turned = nods * Rotation.from_euler("y", degrees, degrees=True)
    found = turned_at_neutral(Pose(turned.as_matrix(), np.zeros((len(TIMES), 3))), "take")
    assert [each.code for each in found] == ["HEAD_TURNED_AT_NEUTRAL"] * (degrees > 0.0)
    assert not found or "15 degrees" in str(found[0])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_short_takes_are_fine(count: int) -> None:
    pose = Pose(POSE.rotations[:count], POSE.translations[:count])
    smooth = smooth_motion(pose, TIMES[:count], FACE, 1e-3, ALL[:count])
    assert np.isfinite(smooth.translations).all() and len(smooth.rotations) == count


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_head_out_of_sight_at_an_end_of_the_take_is_held(noise: float) -> None:
    """The curve would go on as a straight line: here through a whole turn."""
    turn = Rotation.from_rotvec(np.outer(np.linspace(-4.0, 4.0, len(TIMES)), [0.0, 1.0, 0.2]))
    pose = Pose(turn.as_matrix(), np.outer(TIMES, [0.3, 0.0, 0.1]))
    seen = ALL.copy()
    seen[:150] = seen[250:] = False
    held = smooth_motion(pose, TIMES, FACE, noise, seen)
    for end, first in ((slice(None, 151), 150), (slice(249, None), 249)):
        for found in (held.rotations, held.translations):
            np.testing.assert_allclose(found[end], np.broadcast_to(found[first], found[end].shape))
    shown = Rotation.from_matrix(
        held.rotations[150:250].copy()
    )  # SciPy before 1.15.1 wants to write
    away = (shown * turn[150:250].inv()).magnitude()
    assert away.max() < 0.02


def test_without_noise_nothing_is_smoothed() -> None:
    assert smooth_motion(POSE, TIMES, FACE, 0.0, ALL) is POSE


def test_a_head_that_turns_all_around_is_left_as_it_is() -> None:
    spin = Rotation.from_rotvec(np.outer(TIMES, [0.0, 1.0, 0.0])).as_matrix()
    pose = Pose(spin, np.zeros((len(TIMES), 3)))
    assert smooth_motion(pose, TIMES, FACE, 1e-3, ALL) is pose


def test_a_single_wrong_pose_is_kept_and_the_others_are_smoothed() -> None:
    moved = POSE.to_take(np.broadcast_to(FACE, (len(TIMES), *FACE.shape)))
    noisy, _ = rigid_fit(FACE, moved + 1e-3 * RNG.normal(size=moved.shape))
    rotations = noisy.rotations.copy()
    rotations[100] = Rotation.from_rotvec([0.0, 3.0, 0.0]).as_matrix()
    smooth = smooth_motion(Pose(rotations, noisy.translations), TIMES, FACE, 1e-3, ALL)
    np.testing.assert_array_equal(smooth.rotations[100], rotations[100])
    expected = smooth_motion(noisy, TIMES, FACE, 1e-3, ALL)
    others = np.delete(np.arange(len(TIMES)), range(95, 106))
    np.testing.assert_allclose(
        smooth.rotations[others], expected.rotations[others], atol=1e-3, rtol=0
    )


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_what_no_marker_shows_is_bridged_smoothly(noise: float) -> None:
    """A quarter of a second without markers, in which the fit keeps its last pose."""
    moved = POSE.to_take(np.broadcast_to(FACE, (len(TIMES), *FACE.shape)))
    hidden = slice(200, 215)
    seen = ALL.copy()
    seen[hidden] = False
    shown = np.where(seen[..., None], moved + noise * RNG.normal(size=moved.shape), np.nan)
    fitted, _ = rigid_fit(FACE, shown)

    def off(pose: Pose) -> float:
        return float(np.abs(pose.to_take(np.broadcast_to(FACE, moved.shape)) - moved)[hidden].max())

    smooth = smooth_motion(fitted, TIMES, FACE, noise, seen)
    assert off(smooth) < 0.15 * off(fitted)
    rest = np.broadcast_to(FACE, moved.shape)
    change = np.abs(smooth.to_take(rest) - fitted.to_take(rest))
    assert np.delete(change, range(195, 220), axis=0).max() < 1e-6 + 5 * noise


def test_a_frame_counts_by_the_markers_it_shows() -> None:
    """Every third frame shows three neighbouring markers only, which fix a pose badly."""
    moved = POSE.to_take(np.broadcast_to(FACE, (len(TIMES), *FACE.shape)))
    near = np.argsort(np.linalg.norm(FACE - FACE[0], axis=1))[:3]
    seen = ALL.copy()
    seen[::3] = False
    seen[::3, near] = True
    noisy = np.where(seen[..., None], moved + 5e-4 * RNG.normal(size=moved.shape), np.nan)
    fitted, _ = rigid_fit(FACE, noisy)

    def off(pose: Pose) -> float:
        return float(np.sqrt(np.mean((pose.to_take(moved * 0 + FACE) - moved) ** 2)))

    weighed = smooth_motion(fitted, TIMES, FACE, 5e-4, seen)
    assert off(weighed) < 0.5 * off(smooth_motion(fitted, TIMES, FACE, 5e-4, ALL))
