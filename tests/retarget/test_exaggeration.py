"""Exaggeration scales the solved motion, and nothing else."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from curved_world import make_curved_world
from pxr import Usd
from worlds import NEUTRAL, World, make_world

import usdface
from usdface import InputError, ProcessOptions, Shot, ShotResult, WeightsTake
from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.face.layout import FaceLayout
from usdface.io.bind_file import setup_of_json
from usdface.retarget.exaggeration import Exaggeration, exaggerated
from usdface.rigs import Combination
from usdface.schemas import tokens
from usdface.setup.pin import Pin

BROWS = tuple(name for name in make_world().rig.shape_names if name.startswith("brow"))


def shot_of(world: World, **more: object) -> Shot:
    setup = setup_of_json(world.bind | more, "bind.json")
    return usdface.assemble_shot(world.rig, world.take, setup=setup)[0]


def played(shot: Shot, **factors: float) -> ShotResult:
    return usdface.retarget(shot, options=ProcessOptions(express=False, exaggeration=factors))


@pytest.fixture(scope="module")
def shot() -> Shot:
    return shot_of(make_world())


@pytest.fixture(scope="module")
def plain(shot: Shot) -> ShotResult:
    return played(shot)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.0, 0.5, 1.3, 4.0])
def test_the_motion_of_an_exact_world_grows_by_the_factor_up_to_the_bounds(
    shot: Shot, plain: ShotResult, factor: float
) -> None:
    result = played(shot, face=factor)
    wanted = np.clip(factor * make_world().weights, 0.0, 1.0)
    np.testing.assert_allclose(result.solved.weights, wanted, atol=1e-4)
    free = (factor * plain.solved.weights).max(axis=1) < 1
    skin = shot.face.displacements
    np.testing.assert_allclose(
        skin(result.solved.weights)[free], factor * skin(plain.solved.weights)[free], atol=1e-12
    )
    assert free[:NEUTRAL].all()


def test_rest_head_and_residual_stay(shot: Shot, plain: ShotResult) -> None:
    result = played(shot, face=1.7)
    assert np.abs(result.solved.weights[:NEUTRAL]).max() < 1e-4
    assert result.head_motion is not None and plain.head_motion is not None
    assert result.solution is not None and plain.solution is not None
    np.testing.assert_array_equal(result.head_motion.rotations, plain.head_motion.rotations)
    np.testing.assert_array_equal(result.solution.residual, plain.solution.residual)


def test_1_is_byte_for_byte_no_factor(shot: Shot, plain: ShotResult) -> None:
    for result in (played(shot, face=1.0), played(shot, face=1.0, brows=1.0)):
        assert result.solved.weights.tobytes() == plain.solved.weights.tobytes()


def test_a_region_changes_its_own_blend_shapes_only(shot: Shot, plain: ShotResult) -> None:
    result = played(shot, brows=1.5)
    own = np.isin(plain.solved.names, BROWS)
    before, after = plain.solved.weights, result.solved.weights
    np.testing.assert_array_equal(after[:, ~own], before[:, ~own])
    np.testing.assert_allclose(after[:, own], np.clip(1.5 * before[:, own], 0, 1), atol=1e-12)
    both = played(shot, face=0.5, brows=1.5).solved.weights
    np.testing.assert_allclose(both[:, own], 0.75 * before[:, own], atol=1e-12)
    np.testing.assert_allclose(both[:, ~own], 0.5 * before[:, ~own], atol=1e-12)


def test_regions_are_found_where_the_shot_names_none(shot: Shot, plain: ShotResult) -> None:
    bare = replace(shot, layout=FaceLayout())
    found, named = (played(one, eyes=0.5).solved.weights for one in (bare, shot))
    np.testing.assert_array_equal(found, named)
    assert not np.array_equal(named, plain.solved.weights)


def test_a_bent_path_is_followed_as_far_as_the_factor_says() -> None:
    """Twice as far along the whole shape, wherever the inbetweens lie; combinations follow."""
    mesh = make_curved_world().rig.meshes[0]
    names, lid = mesh.shape_names, mesh.shape_names.index("eyeBlinkLeft")
    weights = np.zeros((5, len(names)))
    weights[:, lid] = np.linspace(0.05, 0.4, 5)
    weights[:, names.index("jawOpen")] = 0.3
    weights[:, names.index("mouthSmileLeft")] = 0.2
    take = WeightsTake(names, np.arange(5.0), weights, 1.0)
    after = exaggerated(take, Exaggeration.constant({"face": 2.0}), mesh, FaceLayout()).weights
    whole = mesh.shapes[lid].offsets

    def along(rows: FloatArray) -> FloatArray:
        alone = np.where(np.arange(len(names)) == lid, rows, 0.0)
        moved = usdface_points(mesh, alone)[:, mesh.shapes[lid].indices]
        return np.asarray((moved * whole).sum(axis=(1, 2)) / (whole**2).sum())

    np.testing.assert_allclose(along(after), np.minimum(2 * along(weights), 1.0), atol=1e-9)
    open_left = after[:, names.index("smileOpenLeft")]
    product = after[:, names.index("jawOpen")] * after[:, names.index("mouthSmileLeft")]
    np.testing.assert_allclose(open_left, product)
    assert product[0] > 0.2


def usdface_points(mesh: usdface.Mesh, weights: FloatArray) -> FloatArray:
    from usdface.blend_shapes.vertex_evaluator import evaluator_of

    evaluator, _ = evaluator_of(mesh.shapes, np.arange(len(mesh.points)))
    return evaluator.displacements(weights).reshape(len(weights), -1, 3)


def test_a_weight_stays_below_the_one_that_limits_it() -> None:
    mesh = make_world().rig.meshes[0]
    limited = replace(mesh.shapes[1], combination=Combination(("jawOpen",), "limit"))
    mesh = replace(mesh, shapes=(mesh.shapes[0], limited, *mesh.shapes[2:]))
    take = WeightsTake(("mouthSmileLeft", "jawOpen"), np.arange(2.0), np.array([[0.3, 0.4]] * 2))
    layout = FaceLayout(regions={"mouth": ("jawOpen",), "eyes": ("mouthSmileLeft",)})
    after = exaggerated(take, Exaggeration.constant({"eyes": 3.0}), mesh, layout).weights
    np.testing.assert_allclose(after, [[0.4, 0.4]] * 2)
    closed = exaggerated(take, Exaggeration.constant({"mouth": 0.5}), mesh, layout).weights
    np.testing.assert_allclose(closed, [[0.2, 0.2]] * 2)


def test_pinned_weights_are_kept(shot: Shot) -> None:
    pins = (Pin("jawOpen", np.array([20]), np.array([0.35])),)
    pinned = replace(shot, setup=replace(shot.setup, pins=pins))
    column = shot.mesh.shape_names.index("jawOpen")
    assert played(pinned, face=2.0).solved.weights[20, column] == 0.35


def test_a_take_of_weights_obeys_too(shot: Shot) -> None:
    world = make_world()
    take = WeightsTake(world.rig.shape_names, world.take.times, world.weights, 30.0)
    bare, _ = usdface.assemble_shot(world.rig, take)
    np.testing.assert_allclose(played(bare, face=0.5).solved.weights, 0.5 * world.weights)


@pytest.mark.slow
def test_a_layer_over_the_shot_animates_it_and_the_command_goes_before(tmp_path: Path) -> None:
    folder = make_world().write(tmp_path, exaggeration={"face": 0.5, "mouth": 0.8})
    files = (folder / "rig.usda", folder / "take.usda", folder / "shot.usda")
    usdface.make_shot(*files, bind=folder / "bind.json")
    solved = usdface.process(folder / "shot.usda").value.solved
    exact = make_world().weights
    mouth = np.array([name.startswith(("jaw", "mouth")) for name in solved.names])
    np.testing.assert_allclose(solved.weights[:, mouth], 0.4 * exact[:, mouth], atol=1e-4)
    np.testing.assert_allclose(solved.weights[:, ~mouth], 0.5 * exact[:, ~mouth], atol=1e-4)

    over = Usd.Stage.CreateNew(str(folder / "over.usda"))
    over.GetRootLayer().subLayerPaths = ["shot.usda"]
    over.SetTimeCodesPerSecond(30.0)
    attribute = over.GetPrimAtPath("/Shot/Retarget").GetAttribute(tokens.EXAGGERATION)
    for code, value in ((0.0, 1.0), (39.0, 0.0)):
        attribute.Set(value, code)
    over.Save()
    faded = usdface.process(folder / "over.usda").value.solved
    fade = np.linspace(1, 0, len(exact))[:, None]
    np.testing.assert_allclose(faded.weights[:, ~mouth], (fade * exact)[:, ~mouth], atol=1e-4)

    command = ["process", str(folder / "shot.usda"), "--exaggeration", "1,mouth=0"]
    assert main([*command, "--report", str(folder / "report.json")]) == 0
    again = usdface.process(
        folder / "shot.usda", options=ProcessOptions(exaggeration={"face": 1.0, "mouth": 0.0})
    ).value.solved
    np.testing.assert_allclose(again.weights, np.where(mouth, 0.0, exact), atol=1e-4)


def test_a_factor_that_cannot_be_is_refused(tmp_path: Path) -> None:
    for wrong in ({"brow": 1.0}, {"face": -0.1}, {"eyes": 4.5}, {"eyes": float("nan")}):
        for make in (
            lambda parts: ProcessOptions(exaggeration=parts),
            lambda parts: Exaggeration.constant(parts),
            lambda parts: setup_of_json(make_world().bind | {"exaggeration": parts}, "b.json"),
        ):
            with pytest.raises(InputError, match="exaggeration of"):
                make(wrong)
    result = {
        "cheeks": "; the blend shapes of cheeks belong to mouth and eyes$",
        "jaw": "; the blend shapes of jaw belong to mouth$",
        "brow": r"; did you mean brows\?$",
        "hand": "expected face, brows, eyes, mouth$",
    }
    for part, end in result.items():
        with pytest.raises(InputError, match=end):
            ProcessOptions(exaggeration={part: 1.5})
    with pytest.raises(InputError, match='"exaggeration"'):
        setup_of_json(make_world().bind | {"exaggeration": {"face": "big"}}, "bind.json")
    assert main(["process", str(tmp_path / "shot.usda"), "--exaggeration", "brows=big"]) == 1
