from dataclasses import replace

import numpy as np
import pytest
from filmed import FACE, FOCAL, WORLD, filmed, found, true_weights

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake


def test_a_turning_head_shows_how_deep_the_face_is() -> None:
    deeper = np.random.default_rng(5).normal(scale=0.003, size=len(FACE))
    own = FACE + deeper[:, None] * [0.0, 0.0, 1.0]
    take, _ = filmed(
        replace(WORLD, take=replace(WORLD.take, positions=WORLD.take.positions + own - FACE)), 25.0
    )
    head, _ = found(replace(take, focal_length=FOCAL))
    off = head.rest[:, 2] - own[:, 2]
    # Shifts, turns and scale along the view are those of the pose.
    columns = np.column_stack([np.ones(len(FACE)), FACE])
    off = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
    before = deeper - columns @ np.linalg.lstsq(columns, deeper, rcond=None)[0]
    assert np.sqrt(np.mean(off**2)) < 0.3 * np.sqrt(np.mean(before**2))


def test_a_face_that_does_not_turn_keeps_the_depths_of_the_character() -> None:
    take, _ = filmed(WORLD, 0.0)
    noise = np.random.default_rng(6).normal(scale=0.3, size=take.positions.shape)
    head, _ = found(replace(take, positions=take.positions + noise, focal_length=FOCAL))
    assert np.sqrt(np.mean((head.rest[:, 2] - FACE[:, 2]) ** 2)) < 0.002


@pytest.mark.parametrize("visible", [0, 1, 2])
def test_frames_in_which_hardly_a_dot_is_visible_change_little(visible: int) -> None:
    take, _ = filmed(WORLD, 25.0)
    positions = take.positions.copy()
    positions[14:17, visible:] = np.nan
    whole, _ = found(replace(take, focal_length=FOCAL))
    head, _ = found(replace(take, positions=positions, focal_length=FOCAL))
    assert np.abs(head.rest - whole.rest).max() < 0.001


@pytest.mark.parametrize("hidden", [0, 4])
def test_expressions_that_the_solve_leaves_make_no_depth(hidden: int) -> None:
    """A still face that hardly turns by its pose: a tenth of each movement is taken for turns."""

    def most_of_the_weights(
        skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]
    ) -> FloatArray:
        return 0.9 * true_weights(skin, take, views, neutral)

    take, _ = filmed(WORLD, 0.0)
    positions = take.positions.copy()
    positions[20 : 20 + hidden, 3] = np.nan
    film = replace(take, positions=positions, focal_length=FOCAL)
    head, _ = found(film, solve=most_of_the_weights)
    assert np.sqrt(np.mean((head.rest[:, 2] - FACE[:, 2]) ** 2)) < 0.001
