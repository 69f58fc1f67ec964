"""The residual of a solve as colours of the skin."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.errors import InputError
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.residual_colours import residual_colours
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot, ShotResult

GREY, RED = (0.3, 0.31, 0.33), (0.75, 0.0, 0.12)


@pytest.fixture(scope="module")
def result() -> ShotResult:
    world = make_world(head_moves=False)
    binding = Binding(tuple(world.points), np.array(list(world.points.values())))
    setup = RetargetSetup(binding, nose_tip="nose", neutral=(0, 3))
    return retarget(Shot(world.rig, world.take, setup))


def with_distances(result: ShotResult, distances: np.ndarray) -> ShotResult:
    assert result.solution is not None
    return replace(result, solution=replace(result.solution, distances=distances))


def test_a_face_that_follows_its_markers_is_grey(result: ShotResult) -> None:
    """Noiseless markers of the rig itself leave a thousandth of a millimetre."""
    colours = residual_colours(result, (0, 20))
    assert colours.shape == (2, len(result.shot.mesh.points), 3)
    np.testing.assert_allclose(colours, np.broadcast_to(GREY, colours.shape), atol=0.01)


def test_one_marker_off_colours_its_own_skin_in_its_own_frame(result: ShotResult) -> None:
    assert result.solution is not None
    distances = np.zeros_like(result.solution.distances)
    column = result.solution.markers.index("chin")
    distances[7, column] = 0.002
    before, there = residual_colours(with_distances(result, distances), (6, 7))
    np.testing.assert_array_equal(before, np.broadcast_to(GREY, before.shape))
    vertex = result.shot.face.vertex_of["chin"]
    np.testing.assert_allclose(there[vertex], RED, atol=0.05)
    brow = result.shot.face.vertex_of["brow_mid_l"]
    np.testing.assert_allclose(there[brow], GREY, atol=0.01)


def test_an_occluded_marker_colours_nothing(result: ShotResult) -> None:
    assert result.solution is not None
    distances = np.zeros_like(result.solution.distances)
    distances[:, 0] = np.nan
    colours = residual_colours(with_distances(result, distances), (3,))
    np.testing.assert_array_equal(colours, np.broadcast_to(GREY, colours.shape))


def test_no_such_frame_and_no_markers_are_one_line(result: ShotResult) -> None:
    with pytest.raises(InputError, match="frames 0 to 39"):
        residual_colours(result, (40,))
    with pytest.raises(InputError, match="weights only"):
        residual_colours(replace(result, solution=None), (0,))
