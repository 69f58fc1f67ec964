from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

import usdface
from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import Inbetween
from usdface.face.bound_face import bound_face
from usdface.options import ProcessOptions
from usdface.retarget.neutral_weights import LARGEST
from usdface.rigs import Mesh, Rig
from usdface.shot.measures import shot_measures
from usdface.shot.neutral_measures import neutral_at_limit, neutral_expressive
from usdface.shot.shot import ShotResult
from usdface.verdict.criteria import CRITERIA
from usdface.verdict.judge import judge

EARLY = 0.6


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def with_inbetween(mesh: Mesh) -> Mesh:
    """The jaw is 0.6 of its way down at weight 0.2."""
    shapes = [
        replace(shape, inbetweens=(Inbetween("early", 0.2, EARLY * shape.offsets),))
        if shape.name == "jawOpen"
        else shape
        for shape in mesh.shapes
    ]
    return replace(mesh, shapes=tuple(shapes))


def retargeted(world: World, mesh: Mesh, weights: FloatArray, **changes: object) -> ShotResult:
    """Retarget a performance on the mesh itself; its first frames are the neutral."""
    setup = world.setup(neutral=(0, NEUTRAL - 1))
    face = bound_face(mesh, setup)
    moved = face.displacements(weights)[:, [face.markers.index(n) for n in world.take.names]]
    rest = mesh.points[[world.points[name] for name in world.take.names]]
    times = np.arange(len(weights)) / world.take.rate
    take = replace(world.take, positions=rest + moved, times=times)
    setup = replace(setup, head="solve", head_markers=(), **changes)
    shot, _ = usdface.assemble_shot(Rig("face", (mesh,)), take, setup=setup)
    return usdface.retarget(shot, options=ProcessOptions(express=False, closure=False))


def performed(world: World, **shown: float) -> FloatArray:
    """Return the world's performance, to and fro, after neutral frames that show some weights."""
    names = world.rig.meshes[0].shape_names
    weights = np.concatenate([world.weights, world.weights[NEUTRAL:][::-1]])
    weights[:NEUTRAL] = [shown.get(name, 0.0) for name in names]
    return weights


def measured(result: ShotResult) -> float:
    assert result.solution is not None
    solution = result.solution
    motion = float(np.sqrt((solution.displaced(slice(None)) ** 2).sum(axis=2).mean()))
    return neutral_expressive(result.shot, solution, motion).value


def limit_of(code: str) -> float:
    return next(each.look_at for each in CRITERIA if each.code == code)


@pytest.mark.parametrize("given", [True, False])
def test_a_weight_that_is_taken_off_is_taken_off_along_its_inbetweens(
    world: World, given: bool
) -> None:
    mesh = with_inbetween(world.rig.meshes[0])
    changes = {"neutral_weights": {"jawOpen": 0.1}} if given else {}
    result = retargeted(world, mesh, performed(world, jawOpen=0.1), **changes)
    assert result.solution is not None
    assert result.solution.neutral_weights["jawOpen"] == pytest.approx(0.1, abs=0.02)
    assert measured(result) < limit_of("NEUTRAL_EXPRESSIVE")


def test_an_expression_that_stays_in_the_neutral_is_measured(world: World) -> None:
    kept = replace(world.setup().solve, neutral="given")
    mesh = world.rig.meshes[0]
    result = retargeted(world, mesh, performed(world, jawOpen=0.3), solve=kept)
    assert measured(result) > limit_of("NEUTRAL_EXPRESSIVE")
    assert measured(retargeted(world, mesh, performed(world))) < 0.1


def test_a_take_of_neutral_frames_alone_and_markers_that_no_shape_moves_say_nothing(
    world: World,
) -> None:
    mesh = world.rig.meshes[0]
    result = retargeted(world, mesh, performed(world))
    whole = replace(result.shot.setup, neutral=(0, len(result.shot.take.times) - 1))
    assert np.isnan(measured(replace(result, shot=replace(result.shot, setup=whole))))
    stiff = tuple(replace(shape, offsets=0.0 * shape.offsets) for shape in mesh.shapes)
    rig = Rig("face", (replace(mesh, shapes=stiff),))
    assert np.isnan(measured(replace(result, shot=replace(result.shot, rig=rig))))


def test_a_still_take_is_no_expression(world: World) -> None:
    still = np.zeros_like(performed(world))
    found = shot_measures(retargeted(world, world.rig.meshes[0], still), {})
    assert not {"NEUTRAL_EXPRESSIVE", "MOTION_UNEXPLAINED", "MOTION_BEYOND_SHAPES"} & set(found)
    assert [r.criterion.code for r in judge(found).reasons] == ["PERFORMANCE_STILL"]


def test_a_found_weight_at_its_limit_may_be_more_and_a_named_one_is_all(world: World) -> None:
    mesh = world.rig.meshes[0]
    result = retargeted(world, mesh, performed(world, jawOpen=0.9))
    setup, solution, face = result.shot.setup, result.solution, result.shot.face
    assert solution is not None and solution.neutral_weights["jawOpen"] == LARGEST
    cut = neutral_at_limit(setup, solution, face)
    assert (cut.value, cut.where, cut.frames) == (LARGEST, ("jawOpen",), (0, NEUTRAL - 1))
    assert cut.value == limit_of("NEUTRAL_AT_LIMIT")
    named = replace(setup, neutral_weights={"jawOpen": LARGEST})
    assert np.isnan(neutral_at_limit(named, solution, face).value)
