from dataclasses import replace

import numpy as np
import pytest
from filmed import CAMERA, FOCAL, NEUTRAL, VERTICES, WORLD, filmed, found, true_weights

from usdface.arrays import FloatArray
from usdface.retarget.film.filmed_errors import filmed_marker_errors
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.solve_film import solve_film
from usdface.takes import MarkerTake

DRIFTS = 5


def trembling(degrees: float, *, drift: float = 0.0) -> MarkerTake:
    """A film with noise of 0.2 px, in which one dot's track drifts by so much [px]."""
    take, _ = filmed(WORLD, degrees)
    positions = take.positions + np.random.default_rng(2).normal(0.0, 0.2, take.positions.shape)
    positions[:, DRIFTS] += np.linspace(0.0, drift, len(positions))[:, None] * [0.6, -0.8]
    return replace(take, positions=positions, focal_length=FOCAL)


def errors(take: MarkerTake) -> FloatArray:
    return filmed_marker_errors(
        solve_film(FilmedTake(take, VERTICES, NEUTRAL), CAMERA, true_weights_of_vertices, 6)
    )


def true_weights_of_vertices(*given: object) -> FloatArray:
    return true_weights(VERTICES, *given)  # type: ignore[arg-type]


@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_a_track_that_drifts_has_a_larger_error(degrees: float) -> None:
    found = errors(trembling(degrees, drift=8.0))
    assert found.argmax() == DRIFTS and found[DRIFTS] > 3.0
    assert np.delete(found, DRIFTS).max() < 2.0
    np.testing.assert_array_less(errors(trembling(degrees)), 1.5)


def test_the_depth_of_a_face_is_no_error() -> None:
    """A marker 9 mm deeper than the character's moves otherwise as the head turns."""
    deep = WORLD.take.positions + np.where(np.arange(len(WORLD.take.names)) == DRIFTS, 0.009, 0.0)[
        :, None
    ] * [0.0, 0.0, -1.0]
    take, _ = filmed(replace(WORLD, take=replace(WORLD.take, positions=deep)), 20.0)
    noise = np.random.default_rng(2).normal(0.0, 0.2, take.positions.shape)
    assert errors(replace(take, positions=take.positions + noise))[DRIFTS] < 2.0


def test_an_occluded_dot_has_an_error_where_it_is_seen() -> None:
    take = trembling(20.0, drift=8.0)
    positions = take.positions.copy()
    positions[5:12, DRIFTS] = np.nan
    positions[3:9, 2] = np.nan
    found = errors(replace(take, positions=positions))
    assert found.argmax() == DRIFTS and np.isfinite(found).all()


def test_the_head_is_solved_without_a_track_that_drifts() -> None:
    take, straight = trembling(20.0, drift=30.0), trembling(20.0)
    heads = {weighted: found(take, weighted=weighted) for weighted in (False, True)}
    exact, _ = found(straight, weighted=False)
    off = [
        np.abs(head.motion.rotations - exact.motion.rotations).max() for head, _ in heads.values()
    ]
    assert off[1] < 0.4 * off[0]
    assert [codes for _, codes in heads.values()] == [[], ["MARKER_INACCURATE"]]
    np.testing.assert_array_equal(heads[False][0].errors, 1.0)
