import numpy as np
import pytest

from usdface.figures.labels import label_places, text_size

DOT = 6.0


def covered(places: np.ndarray, sizes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the area that each name shares with the others and with points: (N,)."""
    boxes = np.concatenate([places, points])
    wide = np.concatenate([sizes, np.full_like(sizes, DOT)])
    room = 0.5 * (sizes[:, None] + wide) - np.abs(places[:, None] - boxes)
    shared = np.clip(room, 0.0, None).prod(axis=2)
    shared[np.arange(len(places)), np.arange(len(places))] = 0.0
    return np.asarray(shared.sum(axis=1))


@pytest.mark.parametrize("apart", [12.0, 20.0, 60.0])
def test_names_along_a_line_cover_nothing(apart: float) -> None:
    """Beside each other, at a distance at which the names alone would run into each other."""
    points = np.column_stack([apart * np.arange(6), np.zeros(6)])
    sizes = text_size(["lip_upper_left"] * 6, 6.5)
    assert sizes[0, 0] > 40
    places = label_places(points, sizes, DOT)
    np.testing.assert_allclose(covered(places, sizes, points), 0.0, atol=1.0)


def test_a_name_alone_is_beside_its_point() -> None:
    sizes = text_size(["chin"], 6.5)
    ((x, y),) = label_places(np.array([[3.0, 5.0]]), sizes, DOT)
    assert 0.5 * sizes[0, 0] < x - 3.0 < 0.5 * sizes[0, 0] + DOT
    assert y == pytest.approx(5.0)


def test_no_point_has_no_name() -> None:
    assert label_places(np.zeros((0, 2)), text_size([], 6.5), DOT).shape == (0, 2)


def test_moving_all_points_moves_all_names() -> None:
    points = np.random.default_rng(0).uniform(0, 200, (30, 2))
    sizes = text_size([f"marker_{i}" for i in range(30)], 6.5)
    shift = np.array([64.0, -32.0])
    moved = label_places(points + shift, sizes, DOT) - shift
    np.testing.assert_allclose(moved, label_places(points, sizes, DOT), atol=1e-9)
