import numpy as np

from usdface.certificate.stored_steps import HalfSteps, StoredSteps

FRAMES = np.arange(5)
RNG = np.random.default_rng(1)


def rounded(values: np.ndarray, half: float) -> np.ndarray:
    return np.round(values / (2 * half)) * (2 * half)


def test_no_rounded_pose_is_farther_off_than_stated() -> None:
    """Points and two shapes, rounded to whole numbers, posed and shown at twice their size."""
    points, moves = RNG.normal(size=(400, 3)), RNG.normal(size=(2, 400, 3))
    weights = RNG.uniform(-1, 2, (5, 2))
    steps = StoredSteps(
        HalfSteps(1e-2, 2e-2, np.array([1e-2, 3e-2]), np.array([2e-2, 1e-2])),
        weights,
        np.full((5, 2), 2.0),
        lambda frames: lengths[frames],
    )
    exact = 2 * (points + np.tensordot(weights, moves, 1))
    kept = rounded(moves[0], 1e-2), rounded(moves[1], 3e-2)
    shown = 2 * (rounded(points, 1e-2) + np.tensordot(weights, kept, 1))
    off = np.linalg.norm(shown - exact, axis=2).max(axis=1)
    most = steps.of_points(FRAMES)
    assert (off <= most).all() and (off > 0.5 * most).all()
    shares = RNG.normal(size=5)
    off = np.linalg.norm(np.tensordot(shares, shown - exact, 1), axis=1).max()
    assert 0.5 * steps.of_mixture(shares, FRAMES) < off <= steps.of_mixture(shares, FRAMES)

    kept = rounded(moves[0], 2e-2), rounded(moves[1], 1e-2)
    turned = 2 * (rounded(points, 2e-2) + np.tensordot(weights, kept, 1))
    lengths = np.linalg.norm(turned, axis=2)
    cosine = (turned * exact).sum(axis=2) / lengths / np.linalg.norm(exact, axis=2)
    angles = np.degrees(np.arccos(cosine.clip(-1, 1)))
    most = steps.of_angles(FRAMES)
    assert (angles <= most).all() and (angles / most).max() > 0.7


def test_an_error_that_can_cancel_a_normal_turns_it_anywhere() -> None:
    steps = StoredSteps(
        HalfSteps(0.0, 1e-3, np.zeros(2), np.zeros(2)),
        np.zeros((5, 2)),
        np.ones((5, 2)),
        lambda frames: np.full((len(frames), 30), 1e-3),
    )
    assert (steps.of_angles(FRAMES) == 180).all()


def test_floats_are_not_rounded() -> None:
    assert not HalfSteps(0.0, 0.0, np.zeros(2), np.zeros(2)).any
    assert HalfSteps(0.0, 0.0, np.zeros(2), np.array([0, 1e-5])).any
