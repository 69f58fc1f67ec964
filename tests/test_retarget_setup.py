import numpy as np
import pytest
from worlds import World, make_world

from usdface.errors import InputError
from usdface.face.fitted_setup import fit_setup
from usdface.retarget_setup import Binding, Expression, Pin, unbound
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


def test_a_pose_is_an_expressions_weights_in_another_order() -> None:
    expression = Expression("joy", ("a", "b"), np.array([0.2, 0.7]))
    np.testing.assert_array_equal(expression.pose(("b", "x", "a")), [0.7, 0.0, 0.2])
    np.testing.assert_array_equal(expression.pose(("x",)), [0.0])


@pytest.mark.parametrize("weights", [[0.5], [0.5, 1.1], [-0.1, 0.5], [np.nan, 0.5]])
def test_an_expression_has_a_weight_in_0_to_1_for_each_shape(weights: list[float]) -> None:
    with pytest.raises(InputError, match="'joy'"):
        Expression("joy", ("a", "b"), np.array(weights))


def test_a_binding_has_one_point_for_each_marker() -> None:
    with pytest.raises(InputError, match="1 points for 2 markers"):
        Binding(("a", "b"), np.array([1]))
    with pytest.raises(InputError, match="twice"):
        Binding(("a", "a"), np.array([1, 2]))


@pytest.mark.parametrize(
    ("frames", "weights", "expected"),
    [
        ([3, 4], [1.0], "1 weights at 2 frames"),
        ([], [], "at least one"),
        ([4, 3], [1.0, 1.0], "do not rise"),
        ([-1], [1.0], "do not rise from 0"),
        ([3], [1.1], "outside 0 to 1"),
    ],
)
def test_a_pin_has_rising_frames_and_a_weight_for_each(
    frames: list[int], weights: list[float], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        Pin("jawOpen", np.array(frames), np.array(weights))


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
