from dataclasses import replace

import numpy as np
import pytest
from worlds import camera_pixels, make_world

from usdface.errors import InputError
from usdface.retarget.film.dot_radii import dot_radii

WORLD = make_world(head_moves=False)
NAMES = tuple(WORLD.points)
POINTS = WORLD.rig.meshes[0].points[list(WORLD.points.values())]


def test_dots_are_as_large_on_the_character_as_on_the_performer() -> None:
    diameters = np.linspace(0.003, 0.006, len(WORLD.take.names))
    take = replace(WORLD.take, positions=2.0 * WORLD.take.positions, diameters=diameters)
    own = diameters[[take.names.index(name) for name in NAMES]]
    np.testing.assert_allclose(dot_radii(take, NAMES, POINTS), 0.25 * own, rtol=0.02)


def test_dots_of_an_image_are_measured_by_the_face_in_it() -> None:
    take = camera_pixels(WORLD.take)
    positions = np.array(take.positions)
    positions[3] = np.nan
    take = replace(take, positions=positions, diameters=np.full(len(take.names), 16.0))
    np.testing.assert_allclose(dot_radii(take, NAMES, POINTS), 8.0 / 4000.0, rtol=0.02)


def test_unknown_stays_unknown() -> None:
    assert np.isnan(dot_radii(WORLD.take, NAMES, POINTS)).all()
    diameters = np.full(len(WORLD.take.names), 0.004)
    diameters[1] = np.nan
    found = dot_radii(
        replace(WORLD.take, diameters=diameters), ("else", *NAMES), POINTS[[0, *range(len(POINTS))]]
    )
    own = [name == WORLD.take.names[1] for name in NAMES]
    assert np.isnan(found).tolist() == [True, *own]


def test_markers_that_are_never_seen_together_tell_no_scale() -> None:
    positions = np.full_like(WORLD.take.positions, np.nan)
    positions[:, 0] = WORLD.take.positions[:, 0]
    take = replace(WORLD.take, positions=positions, diameters=np.full(len(NAMES), 0.004))
    assert np.isnan(dot_radii(take, NAMES, POINTS)).all()


@pytest.mark.parametrize("where", ["bound", "seen"])
def test_markers_at_one_place_tell_no_scale(where: str) -> None:
    positions, points = WORLD.take.positions, POINTS
    if where == "bound":
        points = np.tile(POINTS[0], (len(NAMES), 1))
    else:
        positions = np.tile(positions[:, :1], (1, positions.shape[1], 1))
    take = replace(WORLD.take, positions=positions, diameters=np.full(len(NAMES), 0.004))
    assert np.isnan(dot_radii(take, NAMES, points)).all()


@pytest.mark.parametrize("diameters", [[0.004], [-1.0] * len(NAMES), [0.0] * len(NAMES)])
def test_diameters_that_are_none_are_refused(diameters: list[float]) -> None:
    with pytest.raises(InputError, match="diameter"):
        replace(WORLD.take, diameters=np.array(diameters))
