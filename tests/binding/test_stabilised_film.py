"""Markers of a film without head motion, of which no neutral is known."""

from dataclasses import replace

import numpy as np
import pytest
from filmed import CAMERA, FACE, FOCAL, MESH, PLACES, SIZE, WORLD, filmed, placed, turning

from usdface.binding.stabilised_film import stabilised_film
from usdface.errors import SolveError
from usdface.takes import MarkerTake

OFFSETS = MESH.offsets_at(PLACES)
TRUE = WORLD.take.positions[..., :2]  # across the face, without head motion


def spread(positions: np.ndarray) -> float:
    """RMS distance [m] of markers from their means over the take."""
    return float(np.sqrt(np.nanmean((positions - np.nanmean(positions, axis=0)) ** 2)))


def test_a_face_without_expression_does_not_move() -> None:
    resting = replace(WORLD.take, positions=np.repeat(FACE[None], len(WORLD.take.times), 0))
    take, _ = filmed(replace(WORLD, take=resting), 20.0)
    still = stabilised_film(replace(take, focal_length=FOCAL), FACE, OFFSETS)
    np.testing.assert_allclose(still, resting.positions, rtol=0, atol=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_expressions_stay_and_move_no_head(degrees: float) -> None:
    """An open jaw turns and shrinks a head that is fitted without the shapes."""
    take, _ = filmed(WORLD, degrees)
    still = stabilised_film(take, FACE, OFFSETS)
    named = stabilised_film(replace(take, focal_length=FOCAL), FACE, OFFSETS)
    rigid = stabilised_film(take, FACE, np.zeros((0, *FACE.shape)))
    assert max(spread(each[..., :2] - TRUE) for each in (still, named)) < 2e-4
    assert spread(rigid[..., :2] - TRUE) > 8e-4
    np.testing.assert_array_equal(still[..., 2], np.broadcast_to(FACE[:, 2], still.shape[:2]))


def test_the_depths_of_another_face_are_found_where_the_head_turns() -> None:
    """Else the tip of a longer nose swings as the head turns."""
    motion, deeper = turning(20.0), np.zeros_like(FACE)
    deeper[WORLD.take.names.index("nose"), 2] = 0.005
    deeper[WORLD.take.names.index("chin"), 2] = -0.004
    points = np.repeat((FACE + deeper)[None], len(WORLD.take.times), axis=0)
    image = CAMERA.image(placed(motion).to_take(points))
    take = replace(WORLD.take, positions=image, image_size=SIZE, focal_length=FOCAL)
    still = stabilised_film(take, FACE, OFFSETS)
    assert spread(still) < 6e-5
    rigid = CAMERA.at_depths(image, placed(motion), FACE[:, 2])
    assert spread(rigid) > 4 * spread(still)


def test_occluded_markers_and_frames_that_show_none_are_left_out() -> None:
    take, _ = filmed(WORLD, 10.0)
    positions = take.positions.copy()
    positions[5:9] = np.nan
    positions[20:, take.names.index("chin")] = np.nan
    still = stabilised_film(replace(take, positions=positions), FACE, OFFSETS)
    seen = ~np.isnan(positions[..., 0])
    np.testing.assert_array_equal(~np.isnan(still).any(axis=2), seen)
    whole = stabilised_film(take, FACE, OFFSETS)
    assert np.abs(still - whole)[seen].max() < 2e-3


@pytest.mark.parametrize("count", [1, 4])
def test_false_detections_are_left_out_and_change_nothing_else(count: int) -> None:
    take, _ = filmed(WORLD, 10.0)
    positions = take.positions.copy()
    wild = np.arange(12, 12 + 3 * count, 3)
    positions[wild] = [900.0, -900.0] * np.random.default_rng(0).random((count, len(FACE), 2))
    still = stabilised_film(replace(take, positions=positions), FACE, OFFSETS)
    assert np.isnan(still[wild]).all()
    there = np.setdiff1d(np.arange(len(positions)), wild)
    assert np.abs(still - stabilised_film(take, FACE, OFFSETS))[there].max() < 5e-4


def test_a_long_take_is_solved_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    take, _ = filmed(WORLD, 10.0)
    whole = stabilised_film(take, FACE, OFFSETS)
    monkeypatch.setattr("usdface.binding.stabilised_film._BLOCK", 7)
    np.testing.assert_allclose(stabilised_film(take, FACE, OFFSETS), whole, rtol=0, atol=1e-12)


def test_too_few_markers_at_once_are_an_error() -> None:
    take, _ = filmed(WORLD, 0.0)
    positions = np.full_like(take.positions, np.nan)
    for frame, first in enumerate(range(0, len(take.names), 3)):
        positions[frame, first : first + 3] = take.positions[frame, first : first + 3]
    few = MarkerTake(take.names, take.times, positions, take.rate, image_size=take.image_size)
    with pytest.raises(SolveError, match="no frame shows 4 bound markers"):
        stabilised_film(few, FACE, OFFSETS)
