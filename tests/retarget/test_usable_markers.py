from dataclasses import replace

import numpy as np
import pytest
from worlds import World, make_world

from usdface.errors import InputError
from usdface.retarget.usable_markers import (
    check_bound_markers,
    neutral_counts,
    occlusions,
    usable_markers,
)
from usdface.setup.binding import Binding


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.mark.parametrize(
    ("count", "expected"), [(0, "none of the 2 bound markers"), (1, "1 of the"), (3, "3 of the")]
)
def test_a_take_with_fewer_than_four_bound_markers_is_refused_with_advice(
    world: World, count: int, expected: str
) -> None:
    names = (*list(world.points)[:count], *(("a", "b") if count == 0 else ()))
    setup = replace(world.setup(), binding=Binding(names, np.arange(len(names))), nose_tip="")
    with pytest.raises(InputError, match=expected):
        check_bound_markers(setup, world.take)


def test_bound_markers_that_the_take_lacks_are_named_where_too_few_are_left(world: World) -> None:
    names = (*list(world.points)[:3], "chinn")
    setup = replace(world.setup(), binding=Binding(names, np.arange(4)), nose_tip="")
    with pytest.raises(InputError, match=r"are needed; bound, but not in the take: chinn\. Bind"):
        check_bound_markers(setup, world.take)


def test_markers_that_share_their_vertices_are_refused(world: World) -> None:
    binding = world.setup().binding
    setup = replace(world.setup(), binding=replace(binding, points=binding.points % 3))
    with pytest.raises(InputError, match="share 3 vertices; at least 4"):
        check_bound_markers(setup, world.take)


@pytest.mark.parametrize("rig_neutral", [False, True])
def test_markers_that_are_not_seen_are_told_by_the_neutral_in_use(
    world: World, rig_neutral: bool
) -> None:
    """Other neutral frames are no advice where the neutral is the rig's own."""
    positions = world.take.positions.copy()
    hidden = slice(None) if rig_neutral else slice(0, 1)
    positions[hidden, 3:] = np.nan
    setup = world.setup(neutral=None if rig_neutral else (0, 0))
    points = world.rig.meshes[0].points[setup.binding.points]
    with pytest.raises(InputError, match=r"only 3 of \d+ bound markers") as caught:
        usable_markers(replace(world.take, positions=positions), points, setup)
    assert ("other neutral frames" in str(caught.value)) is not rig_neutral
    assert ("in the neutral frames 0 to 0" in str(caught.value)) is not rig_neutral
    assert ("ind more" in str(caught.value)) is rig_neutral


def test_neutral_frames_in_which_the_face_moves_are_told(world: World) -> None:
    take, mesh = world.take, world.rig.meshes[0]
    rest = np.repeat(take.positions[:1], 20, axis=0)
    rest[8:11] = take.positions[12]
    still = replace(take, positions=rest, times=np.arange(20) / take.rate)
    setup = world.setup(neutral=(2, 19))
    points = mesh.points[setup.binding.points]
    _, neutral, findings = usable_markers(still, points, setup)
    np.testing.assert_allclose(neutral, take.positions[0], atol=1e-12)
    (moves,) = (each for each in findings if each.code == "NEUTRAL_MOVES")
    assert (moves.values["moving_count"], moves.values["frame_count"]) == (3, 18)
    assert neutral_counts(still.positions, setup).tolist() == [15] * len(take.names)


def test_the_marker_that_is_occluded_most_is_the_first() -> None:
    found = occlusions(("lip", "nose", "chin"), np.array([3, 0, 40]), 90)
    assert [(each.where, each.values["occluded_count"]) for each in found] == [
        ("chin", 40),
        ("lip", 3),
    ]
