import numpy as np
import pytest
from worlds import World, make_world

from usdface.errors import InputError
from usdface.retarget_setup import Binding, Expression, RetargetSetup, fit_setup, unbound
from usdface.takes import WeightsTake


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def setup_of(world: World, **changes: object) -> RetargetSetup:
    points = np.array(list(world.points.values()))
    return RetargetSetup(Binding(tuple(world.points), points), **changes)  # type: ignore[arg-type]


def test_nothing_in_a_setup_can_be_changed(world: World) -> None:
    setup = setup_of(world, roles={"lip": "lip_lower"})
    expression = Expression("joy", ("a",), np.ones(1))
    for array in (setup.binding.points, expression.weights):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        setup.roles["lip"] = "chin"  # type: ignore[index]


def test_a_setup_does_not_follow_the_dictionary_it_was_made_of(world: World) -> None:
    roles = {"lip": "lip_lower"}
    setup = setup_of(world, roles=roles)
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


def test_a_rigid_head_needs_three_markers(world: World) -> None:
    with pytest.raises(InputError, match="at least three"):
        setup_of(world, head="markers", head_markers=("temple_l", "temple_r"))


def test_the_mesh_is_named_and_the_foremost_marker_is_the_nose(world: World) -> None:
    mesh = world.rig.meshes[0]
    fitted, findings = fit_setup(setup_of(world), mesh, world.take)
    assert fitted.binding.mesh == "head" and fitted.nose_tip == "nose"
    assert [(f.code, f.where) for f in findings] == [("NOSE_TIP_ASSUMED", "nose")]
    again, findings = fit_setup(fitted, mesh, world.take)
    assert findings == [] and again.nose_tip == "nose"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"nose_tip": "nase"}, "'nase' is not among the bound markers"),
        ({"nose_tip": "nase"}, "; did you mean nose?"),
        ({"head": "markers", "head_markers": ("a", "b", "chin")}, "no marker 'a', 'b'"),
        ({"neutral": (0, 40)}, "frames 0 to 39"),
        ({"binding": Binding(("x", "y"), np.array([1, 2]))}, "no bound marker is in the take"),
        ({"binding": Binding(("nose",), np.array([195]))}, "vertices 0 to 194"),
        ({"binding": Binding(("nose",), np.array([-1]))}, "vertex -1"),
    ],
)
def test_a_setup_must_fit_rig_and_take(world: World, changes: dict[str, object], said: str) -> None:
    setup = setup_of(world) if "binding" not in changes else None
    with pytest.raises(InputError) as caught:
        setup = setup_of(world, **changes) if setup else RetargetSetup(**changes)  # type: ignore[arg-type]
        fit_setup(setup, world.rig.meshes[0], world.take)
    assert said in str(caught.value)


def test_only_a_weights_take_needs_no_binding(world: World) -> None:
    with pytest.raises(InputError, match="--bind"):
        unbound(world.take)
    weights = WeightsTake(world.rig.shape_names, world.take.times, world.weights)
    setup, findings = fit_setup(unbound(weights), world.rig.meshes[0], weights)
    assert setup.binding.markers == () and findings == []
