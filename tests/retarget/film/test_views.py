from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.retarget.film.views import Views

RANDOM = np.random.default_rng(1)
TURNS = Rotation.from_euler("y", [[0.0], [30.0]], degrees=True).as_matrix()
VIEWS = Views(
    ("a", "b"), np.repeat(TURNS[:, None, :2], 2, axis=1), np.array([[1.0, 0.5], [2.0, 0]])
)


def test_a_head_on_view_shows_two_axes_and_one_from_aside_depth() -> None:
    moved = RANDOM.normal(size=(2, 6))
    projected = VIEWS.projected(moved)
    np.testing.assert_allclose(projected[0], moved[0].reshape(2, 3)[:, :2].ravel())
    turned = moved[1].reshape(2, 3) @ TURNS[1].T
    np.testing.assert_allclose(projected[1], turned[:, :2].ravel())


def test_many_displacements_are_projected_as_each_by_itself() -> None:
    many = RANDOM.normal(size=(2, 5, 6))
    projected = VIEWS.weighted(VIEWS.projected(many))
    for k in range(5):
        np.testing.assert_allclose(projected[:, k], VIEWS.weighted(VIEWS.projected(many[:, k])))


def test_samples_count_by_their_certainty() -> None:
    ones = np.ones((2, 4))
    assert VIEWS.weighted(ones).tolist() == [[1.0, 1.0, 0.5, 0.5], [2.0, 2.0, 0.0, 0.0]]
    hidden = VIEWS.where(np.array([[True, False], [True, True]]))
    assert hidden.certainty.tolist() == [[1.0, 0.0], [2.0, 0.0]]


def test_the_errors_of_markers_are_those_of_their_samples() -> None:
    views = Views(("a", "b"), VIEWS.slopes, np.array([[1.0, 0.5], [1.0, 0.25]]))
    np.testing.assert_allclose(views.errors, [1.0, 0.15625**-0.5])


def test_views_of_some_markers_and_frames() -> None:
    other = VIEWS.of(("b", "new"))
    assert other.certainty.tolist() == [[0.5, 0.0], [0.0, 0.0]]
    np.testing.assert_array_equal(other.slopes[:, 0], VIEWS.slopes[:, 1])
    assert not other.slopes[:, 1].any()
    assert VIEWS.of(VIEWS.markers) is VIEWS
    assert VIEWS.at(slice(1, 2)).certainty.tolist() == [[2.0, 0.0]]


def test_parts_of_views_say_whether_displacements_are_mapped() -> None:
    straight = replace(VIEWS, mapped=False)
    parts = straight.of(("b",)), straight.at(slice(1)), straight.where(np.ones((2, 2), bool))
    assert VIEWS.at(slice(1)).mapped and not any(part.mapped for part in parts)


def test_views_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        VIEWS.slopes[0] = 0.0
