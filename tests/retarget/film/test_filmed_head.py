from dataclasses import replace

import numpy as np
import pytest
from filmed import COUNT, FACE, FOCAL, PLACES, WORLD, filmed, found

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.retarget.film.filmed_head import certainty
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake


def no_weights(
    skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]
) -> FloatArray:
    return np.zeros_like(WORLD.weights)


def test_what_is_projected_is_what_the_views_make_of_the_displacements() -> None:
    take, _ = filmed(WORLD, 20.0)
    take = replace(take, focal_length=FOCAL)
    head, _ = found(take)
    projected, views = head.projected(take)
    moved = (WORLD.take.positions - FACE).reshape(COUNT, -1)
    expected = FACE[:, :2] + views.projected(moved).reshape(COUNT, -1, 2)
    np.testing.assert_allclose(projected.positions, expected, atol=1e-7)
    # Of a head that is turned by 20 degrees the image shows what comes forward.
    middle = np.abs(np.median(views.slopes[:, :, 0, 2], axis=1))
    assert middle.max() == pytest.approx(np.sin(np.radians(20.0)), abs=0.15)


def test_a_head_that_rests_is_seen_from_one_side_and_vertices_all_alike() -> None:
    rested = replace(WORLD, take=replace(WORLD.take, positions=np.tile(FACE, (COUNT, 1, 1))))
    take, _ = filmed(rested, 0.0)
    still = np.broadcast_to(take.positions[:1], take.positions.shape)
    head, _ = found(replace(take, positions=still, focal_length=FOCAL), solve=no_weights)
    _, views = head.projected(take)
    assert np.ptp(views.slopes, axis=0).max() < 1e-6
    np.testing.assert_allclose(
        views.slopes[0, :, :, :2], np.tile(np.eye(2), (len(FACE), 1, 1)), atol=0.25
    )
    assert (views.certainty == 1.0).all()


def test_hidden_markers_are_hidden_in_what_is_projected() -> None:
    take, _ = filmed(WORLD, 15.0)
    positions = take.positions.copy()
    positions[5:20, 3] = np.nan
    take = replace(take, positions=positions, focal_length=FOCAL)
    projected, _ = found(take)[0].projected(take)
    assert np.array_equal(np.isnan(projected.positions), np.isnan(positions))


def test_slanted_dots_are_less_certain_and_the_take_as_certain_as_it_says() -> None:
    take, _ = filmed(WORLD, 20.0)
    dots = MarkerSurface(WORLD.rig.meshes[0], PLACES, np.full(len(PLACES), 0.004))
    head, _ = found(replace(take, focal_length=FOCAL), dots)
    visible = np.ones(head.facing.shape, dtype=bool)
    visible[:, 2] = False
    sure = certainty(head.facing, visible, head.errors)
    assert np.mean(sure[visible] ** -2.0) == pytest.approx(1.0)
    ratio = sure / head.facing
    np.testing.assert_allclose(ratio, ratio[0, 0])
    assert head.facing.min() < 0.9 < head.facing.max() <= 1.0
