"""What a system reads off a face, in either space."""

from dataclasses import replace

import numpy as np
import pytest
from chin_system import chin
from expression_systems import expression_system
from worlds import World, make_world

from usdface.correction.feature_extraction import features, sided_features
from usdface.correction.features import MILLIMETRE, smooth
from usdface.errors import InputError
from usdface.expression_system import MarkerFeature
from usdface.face.bound_face import bound_face
from usdface.face.mirror import SIDES
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.options import FEATURE_SMOOTHING, PIN_REACH
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.pins import with_pins
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def setup(world: World) -> RetargetSetup:
    points = np.array(list(world.points.values()))
    return RetargetSetup(
        Binding(tuple(world.points), points),
        neutral=(0, 3),
        nose_tip="nose",
        roles={"middle_chin": "chin"},
    )


@pytest.fixture(scope="module")
def solution(world: World, setup: RetargetSetup) -> Solution:
    mesh, points = world.rig.meshes[0], setup.binding.points
    found, _ = solve_take(
        world.take,
        BoundPoints.linear(mesh.points[points], mesh.offsets_at(points), mesh.shape_names),
        setup,
    )
    return found


def test_both_spaces_agree_where_performer_and_character_are_one(
    world: World, setup: RetargetSetup, solution: Solution
) -> None:
    mesh = world.rig.meshes[0]
    given = (bound_face(mesh, setup), world.take)
    solved = {"weights": solution.weights, "solution": solution}
    taken, drawn = (features(chin(space), *given, **solved) for space in ("take", "character"))
    np.testing.assert_allclose(taken, drawn, atol=1e-4)
    markers = setup.binding.markers
    moves = mesh.offsets_at(setup.binding.points)[..., 1]
    lowered = world.weights @ (moves[:, markers.index("chin")] - moves[:, markers.index("nose")])
    np.testing.assert_allclose(drawn[:, 0], lowered / MILLIMETRE, atol=1e-4)
    noisy = replace(solution, noise=1.0)  # then, and only then, they are smoothed
    expected = smooth(drawn, world.take.times, FEATURE_SMOOTHING)
    found = features(chin("character"), *given, weights=solution.weights, solution=noisy)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(expected - drawn).max() > 1.0
    assert lowered.min() < -0.01


def test_the_head_does_not_move_the_features(
    world: World, setup: RetargetSetup, solution: Solution
) -> None:
    still = make_world(head_moves=False)
    mesh = still.rig.meshes[0]
    steady = replace(setup, head="stabilised")
    points = setup.binding.points
    calm, _ = solve_take(
        still.take,
        BoundPoints.linear(mesh.points[points], mesh.offsets_at(points), mesh.shape_names),
        steady,
    )
    face = bound_face(mesh, setup)
    nodding, resting = (
        features(chin("take"), face, take, weights=found.weights, solution=found)
        for take, found in ((world.take, solution), (still.take, calm))
    )
    np.testing.assert_allclose(nodding, resting, atol=1e-3)


def test_a_weights_take_has_no_markers_of_its_own(world: World, setup: RetargetSetup) -> None:
    take = WeightsTake(world.rig.shape_names, world.take.times, world.weights)
    face = bound_face(world.rig.meshes[0], setup)
    with pytest.raises(InputError, match='"character"'):
        features(chin("take"), face, take, weights=take, solution=None)
    assert features(chin("character"), face, take, weights=take, solution=None).shape == (40, 1)


def test_weights_of_the_whole_rig_in_any_order_move_the_bound_mesh_alike(
    world: World, setup: RetargetSetup
) -> None:
    """A rig may have a tongue of its own; recorded weights name its shapes, too."""
    names = world.rig.shape_names
    take = WeightsTake(names, world.take.times, world.weights)
    whole = take.reordered(("tongueOut", *reversed(names)))
    face = bound_face(world.rig.meshes[0], setup)
    found, expected = (
        sided_features(chin("character"), face, played, weights=played, solution=None).sides
        for played in (whole, take)
    )
    for side in SIDES:
        np.testing.assert_array_equal(found[side], expected[side])
        assert np.abs(expected[side]).max() > 1.0


def test_of_both_sides_they_are_the_features_of_the_face(
    world: World, setup: RetargetSetup, solution: Solution
) -> None:
    given = (bound_face(world.rig.meshes[0], setup), world.take)
    solved = {"weights": solution.weights, "solution": solution}
    for space in ("take", "character"):
        sided = sided_features(chin(space), *given, **solved).sides
        assert tuple(sided) == SIDES
        np.testing.assert_array_equal(sided["both"], features(chin(space), *given, **solved))
        # The chin is in the middle, where its height is that of either half.
        np.testing.assert_allclose(sided["left"], sided["right"], atol=0.2)


def test_frames_that_a_pin_bends_tell_nothing_of_how_far_the_performer_moves(
    world: World, setup: RetargetSetup, solution: Solution
) -> None:
    """A jaw that the artist closes in frame 20 is no reason to enlarge the motion of others."""
    face, pin = bound_face(world.rig.meshes[0], setup), Pin("jawOpen", [20], [0.0])
    names, times = solution.weights.names, solution.weights.times
    bent = replace(
        solution.weights, weights=with_pins((pin,), names, times, solution.weights.weights)
    )
    before, after = (
        sided_features(
            chin("character"), face, world.take, weights=weights, solution=solution, pins=pins
        ).sides["both"][:, 0]
        for weights, pins in ((solution.weights, ()), (bent, (pin,)))
    )
    far = np.abs(times - times[20]) > PIN_REACH
    assert np.abs(after - before)[~far].max() > 1.0
    np.testing.assert_allclose(after[far], before[far], atol=0.01)


def test_a_role_without_a_marker_is_named_with_the_rule_that_asks_for_it(
    world: World, setup: RetargetSetup
) -> None:
    """And with the marker whose name is next to it."""
    system = expression_system(
        (
            Variable("chin_y", "input", terms=(Term("down", "ramp", (0.0, -0.1)),)),
            Variable("joy", "output"),
        ),
        (parse_rule("IF chin_y IS down THEN joy IS 1", place="mine.fis, line 7"),),
        (MarkerFeature("chinn"),),
    )
    mesh = world.rig.meshes[0]
    take = WeightsTake(mesh.shape_names, np.arange(2.0), np.zeros((2, len(mesh.shapes))), 1.0)
    with pytest.raises(InputError) as refused:
        features(system, bound_face(mesh, setup), take, weights=take, solution=None)
    assert refused.value.code == "MARKER_UNKNOWN"
    for result in ("'chinn'", "did you mean chin?", "mine.fis, line 7: rule"):
        assert result in str(refused.value)
