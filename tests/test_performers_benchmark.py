"""Other people's shapes, as the benchmark of performers makes them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import grid

CHECKOUT = Path(__file__).resolve().parents[1]
TURN = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix()


@pytest.fixture(autouse=True)
def checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `python -m benchmarks.performers` finds its modules."""
    monkeypatch.syspath_prepend(str(CHECKOUT))


def face() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (V, 3), triangles (T, 3) and two shapes that leave the rim at rest."""
    places, quads = grid(31, 31)
    u, v = (places / 15 - 1).T
    points = 0.08 * np.stack([u, v, 0.6 * np.cos(u) * np.cos(0.8 * v)], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    bumps = [np.clip(1 - ((u - a) ** 2 + (v - b) ** 2) / 0.4, 0, None) ** 2 for a, b in OF]
    shapes = [bump[:, None] * np.array(move) for bump, move in zip(bumps, MOVES, strict=True)]
    return points, triangles, np.stack(shapes)


OF = ((0.1, 0.2), (-0.2, -0.1))
MOVES = ((0.004, 0.009, 0.002), (-0.003, 0.001, 0.008))
POINTS, TRIANGLES, SHAPES = face()
OTHER = POINTS * [1.05, 0.97, 1.2] + 0.003 * np.sin(40 * POINTS[:, [1, 2, 0]])


def transfer(source: np.ndarray, target: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    from benchmarks.performers.deformation_transfer import transfer

    return transfer(source, target, TRIANGLES, shapes)


def test_the_same_face_has_the_same_shapes() -> None:
    np.testing.assert_allclose(transfer(POINTS, POINTS, SHAPES), SHAPES, atol=1e-12)


def test_a_moved_face_has_the_same_shapes() -> None:
    moved = transfer(POINTS, OTHER + np.array([0.1, -0.2, 0.3]), SHAPES)
    np.testing.assert_allclose(moved, transfer(POINTS, OTHER, SHAPES), atol=1e-12)


def test_shapes_grow_with_the_face() -> None:
    """By its own size: a face twice as large moves twice as far."""
    np.testing.assert_allclose(transfer(POINTS, 2 * POINTS, SHAPES), 2 * SHAPES, atol=1e-12)
    np.testing.assert_allclose(
        transfer(POINTS, 2 * OTHER, SHAPES), 2 * transfer(POINTS, OTHER, SHAPES), atol=1e-12
    )


def test_shapes_turn_with_both_faces() -> None:
    turned = transfer(POINTS @ TURN.T, OTHER @ TURN.T, SHAPES @ TURN.T)
    np.testing.assert_allclose(turned, transfer(POINTS, OTHER, SHAPES) @ TURN.T, atol=1e-12)


def test_the_unit_plays_no_part() -> None:
    metres = transfer(POINTS, OTHER, SHAPES)
    millimetres = transfer(1000 * POINTS, 1000 * OTHER, 1000 * SHAPES)
    np.testing.assert_allclose(millimetres, 1000 * metres, atol=1e-8)


def test_another_face_deforms_as_the_first_one_does() -> None:
    """Edges change by the gradients of the source's triangles, as near as one surface can."""
    moved = transfer(POINTS, OTHER, SHAPES)
    for shape, found in zip(SHAPES, moved, strict=True):
        for corner in (1, 2):
            first, last = TRIANGLES[:, 0], TRIANGLES[:, corner]
            stretch = [
                np.linalg.norm((p + s)[last] - (p + s)[first], axis=1)
                / np.linalg.norm(p[last] - p[first], axis=1)
                - 1
                for p, s in ((POINTS, shape), (OTHER, found))
            ]
            assert np.corrcoef(*stretch)[0, 1] > 0.9
    # Not the same displacements: the other face is another one.
    assert np.abs(moved - SHAPES).max() > 0.02 * np.abs(SHAPES).max()


def test_what_rests_rests() -> None:
    still = ~SHAPES.any(axis=(0, 2))
    assert still.sum() > 300
    moved = transfer(POINTS, OTHER, SHAPES)
    held = np.argsort(np.linalg.norm(SHAPES, axis=2).max(axis=0), kind="stable")[:300]
    assert not moved[:, held].any()
    assert np.abs(moved[:, still]).max() < 0.1 * np.abs(moved).max()


def test_a_shape_that_turns_and_grows_a_whole_face_does_so_with_another() -> None:
    """About one vertex; vertices of no triangle are the others that are held."""
    middle, none = 15 * 31 + 15, np.zeros((299, 3))
    grow = 1.1 * TURN - np.eye(3)
    source, target = np.vstack([POINTS, none]), np.vstack([OTHER, none])
    shape = np.vstack([(POINTS - POINTS[middle]) @ grow.T, none])
    (moved,) = transfer(source, target, shape[None])
    expected = (OTHER - OTHER[middle]) @ grow.T
    np.testing.assert_allclose(moved[: len(OTHER)], expected, atol=1e-10)
