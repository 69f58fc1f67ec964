from dataclasses import replace

import numpy as np
import pytest

from usdface.blend_shapes.blend_shape import BlendShape, Inbetween
from usdface.blend_shapes.inbetween_path import distinct_inbetweens, inbetween_path

FULL = np.array([[0.0, -10.0, 0.0]])


def blink(*inbetweens: tuple[float, float]) -> BlendShape:
    """A lid that is down by a share of the whole at some weights."""
    made = (Inbetween(f"i{k}", w, share * FULL) for k, (w, share) in enumerate(inbetweens))
    return BlendShape("blink", np.array([7]), FULL, inbetweens=tuple(made))


PATH = inbetween_path(blink((0.75, 0.95), (0.5, 0.9)))


@pytest.mark.parametrize(
    ("weight", "share"),
    [(0.0, 0.0), (0.25, 0.45), (0.5, 0.9), (0.75, 0.95), (1.0, 1.0), (1.25, 1.05), (-0.1, -0.18)],
)
def test_it_is_straight_between_inbetweens_and_beyond_the_outer_ones(weight, share) -> None:
    np.testing.assert_allclose(PATH.at(np.array([weight]))[0], share * FULL[0], atol=1e-14)


def test_hats_give_the_weight_back() -> None:
    weights = np.linspace(-0.5, 1.5, 41)
    hats = PATH.hats(weights)
    np.testing.assert_allclose(hats.sum(axis=1), 1.0)
    np.testing.assert_allclose(hats @ PATH.weights, weights, atol=1e-15)


def test_the_corners_between_two_weights_bound_the_path() -> None:
    corners = PATH.knots_between(0.2, 1.1)[:, 1]
    way = PATH.at(np.linspace(0.2, 1.1, 91))[:, 1]
    assert len(corners) == 5
    assert corners.min() == pytest.approx(way.min()) and corners.max() == pytest.approx(way.max())


def test_a_chord_leads_from_one_weight_to_the_other() -> None:
    start, end = np.array([0.1, 0.4, 0.6]), np.array([0.9, 0.4, 0.7])
    slopes = PATH.secants(start, end)
    moved = PATH.at(end) - PATH.at(start)
    np.testing.assert_allclose(slopes * (end - start)[:, None], moved, atol=1e-14)
    assert slopes[1, 1] == pytest.approx(-18.0)  # where nothing changes, that of the path


def test_of_several_inbetweens_at_one_weight_the_first_counts() -> None:
    shape = blink((0.5, 0.9), (0.5, 0.2), (1.0, 0.3), (0.0, 0.3), (0.25, 0.4))
    assert [b.name for b in distinct_inbetweens(shape)] == ["i4", "i0"]
    assert inbetween_path(shape).weights.tolist() == [0.0, 0.25, 0.5, 1.0]


def test_a_share_of_the_whole_shape_has_a_weight_on_the_path() -> None:
    shares = np.array([0.0, 0.45, 0.9, 0.975, 1.0])
    np.testing.assert_allclose(PATH.weights_of(shares), [0.0, 0.25, 0.5, 0.875, 1.0])
    back = inbetween_path(blink((0.3, 1.2)))  # overshoots, and comes back
    assert back.weights_of(np.array([0.6, 1.0])) == pytest.approx([0.15, 0.25])
    still = replace(PATH, displacements=0.0 * PATH.displacements)
    assert still.weights_of(shares).tolist() == shares.tolist()
