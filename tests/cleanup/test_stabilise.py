import numpy as np
from scipy.spatial.transform import Rotation
from worlds import make_world

from usdface.cleanup.stabilise import stabilise

WORLD = make_world(head_moves=False)
STILL = np.tile(WORLD.take.positions, (3, 1, 1))
COUNT = len(STILL)
TURN = Rotation.from_rotvec(0.1 * np.sin(np.outer(np.arange(COUNT), [0.1, 0.07, 0.05]))).as_matrix()
SWAY = 0.02 * np.cos(np.outer(np.arange(COUNT), [0.05, 0.08, 0.03]))
MOVED = STILL @ TURN.transpose(0, 2, 1) + SWAY[:, None]
ALL = np.ones(STILL.shape[:2], dtype=bool)


def test_the_head_is_taken_out_but_for_what_the_face_does() -> None:
    held = stabilise(MOVED, ALL, moving=True)
    apart = held.positions - held.positions[0]
    assert np.abs(apart - (STILL - STILL[0])).max() < 0.003
    np.testing.assert_allclose(held.pose.to_take(held.positions), MOVED, atol=1e-12)


def test_a_lost_marker_does_not_move_the_head() -> None:
    """The chin is lost while the jaw is open: a plain rigid fit moves the others by 0.5 mm."""
    whole = stabilise(MOVED, ALL, moving=True)
    seen = ALL.copy()
    jaw = WORLD.weights[:, WORLD.rig.shape_names.index("jawOpen")].argmax()
    seen[jaw, WORLD.take.names.index("chin")] = False
    held = stabilise(MOVED, seen, moving=True)
    moved = np.linalg.norm(held.positions[jaw] - whole.positions[jaw], axis=1)[seen[jaw]]
    assert moved.max() < 1e-4


def test_a_still_head_stays_as_it_is() -> None:
    held = stabilise(STILL, ALL, moving=False)
    np.testing.assert_array_equal(held.positions, STILL)
    np.testing.assert_array_equal(held.pose.rotations[5], np.eye(3))
