import numpy as np
import pytest
from worlds import World, make_world

from usdface.errors import InputError
from usdface.face.fitted_setup import fit_setup
from usdface.setup.expression import Expression
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import check_neutral_frames, unbound
from usdface.takes import WeightsTake


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def test_nothing_in_a_setup_can_be_changed(world: World) -> None:
    setup = world.setup(roles={"lip": "lip_lower"})
    expression = Expression("joy", ("a",), np.ones(1))
    for array in (setup.binding.points, expression.weights):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        setup.roles["lip"] = "chin"  # type: ignore[index]


def test_a_setup_does_not_follow_the_dictionary_it_was_made_of(world: World) -> None:
    roles = {"lip": "lip_lower"}
    setup = world.setup(roles=roles)
    roles["lip"] = "chin"
    assert setup.roles["lip"] == "lip_lower"


def test_a_blend_shape_has_one_pin(world: World) -> None:
    with pytest.raises(InputError, match="pinned twice"):
        world.setup(pins=(Pin("jaw", [3], [1.0]), Pin("jaw", [4], [0.0])))


def test_a_rigid_head_needs_three_markers(world: World) -> None:
    with pytest.raises(InputError, match="at least three"):
        world.setup(head="markers", head_markers=("temple_l", "temple_r"))


def test_only_a_weights_take_needs_no_binding(world: World) -> None:
    with pytest.raises(InputError, match="--bind"):
        unbound(world.take)
    weights = WeightsTake(world.rig.shape_names, world.take.times, world.weights)
    setup, findings = fit_setup(unbound(weights), world.rig.meshes[0], weights)
    assert setup.binding.markers == () and findings == []


@pytest.mark.parametrize("neutral", [(0, 40), (-1, 3)])
def test_neutral_frames_that_the_take_lacks_are_refused_with_a_remedy(
    neutral: tuple[int, int],
) -> None:
    with pytest.raises(
        InputError, match=r"outside the take a\.c3d, .* 0 to 39; .*--neutral"
    ) as error:
        check_neutral_frames(neutral, 40, "a.c3d")
    assert error.value.code == "FRAMES_OUTSIDE"
    check_neutral_frames((0, 39), 40, "a.c3d")


def test_neutral_frames_from_last_to_first_are_said_to_be_reversed() -> None:
    with pytest.raises(InputError, match="neutral frames 30 to 10 are reversed") as error:
        check_neutral_frames((30, 10), 40, "a.c3d")
    assert error.value.code == "SETTING_WRONG"
