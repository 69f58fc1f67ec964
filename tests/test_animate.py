"""The corrector between take and weights: which space it reads, and what it adds."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import World, animation_of, make_world

from usdface.cli import main
from usdface.errors import InputError
from usdface.express import design, express, features
from usdface.fuzzy.dictionaries import expressions_for
from usdface.fuzzy.features import MILLIMETRE, smooth
from usdface.fuzzy.paper import EMOTIONS, MEDIUM, paper_system
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import FuzzySystem, Term, Variable
from usdface.io.usd.fuzzy import write_fuzzy
from usdface.options import FEATURE_SMOOTHING, CorrectionOptions
from usdface.retarget.transfer import Solution, solve_take
from usdface.setup import Binding, Expression, Setup
from usdface.takes import WeightsTake

# The paper's roles, and who plays them in the small world.
ROLES = {
    "l_eyebrow_middle": "brow_mid_l",
    "l_eyebrow_end": "brow_out_l",
    "l_orbital_upper": "brow_in_l",
    "l_eyelid_upper": "lid_l",
    "l_puffer": "cheek_l",
    "lip_lower": "lip_lower",
    "middle_chin": "chin",
}


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def setup(world: World) -> Setup:
    points = np.array(list(world.points.values()))
    return Setup(Binding(tuple(world.points), points), neutral=(0, 3), nose_tip="nose", roles=ROLES)


@pytest.fixture(scope="module")
def solution(world: World, setup: Setup) -> Solution:
    mesh, points = world.rig.meshes[0], setup.binding.points
    found, _ = solve_take(
        world.take, mesh.points[points], mesh.offsets_at(points), mesh.shape_names, setup
    )
    return found


def chin(space: str, **settings: object) -> FuzzySystem:
    term = Term("open", "ramp", (0.0, -20.0))
    variables = (
        Variable("chin_y", "input", "middle_chin", "y", "signed", (term,)),
        Variable("joy", "output"),
    )
    rule = parse_rule("IF chin_y IS open THEN joy IS 1")
    return FuzzySystem(variables, (rule,), space=space, face_unit="none", **settings)  # type: ignore[arg-type]


def test_both_spaces_agree_where_performer_and_character_are_one(
    world: World, setup: Setup, solution: Solution
) -> None:
    mesh = world.rig.meshes[0]
    given = (world.take, mesh, setup, solution.weights, solution)
    taken, drawn = (features(chin(space), *given) for space in ("take", "character"))
    np.testing.assert_allclose(taken, drawn, atol=1e-4)
    markers = setup.binding.markers
    moves = mesh.offsets_at(setup.binding.points)[..., 1]
    lowered = world.weights @ (moves[:, markers.index("chin")] - moves[:, markers.index("nose")])
    np.testing.assert_allclose(drawn[:, 0], lowered / MILLIMETRE, atol=1e-4)
    noisy = replace(solution, noise=1.0)  # then, and only then, they are smoothed
    expected = smooth(drawn, world.take.times, FEATURE_SMOOTHING)
    found = features(chin("character"), *given[:-1], noisy)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(expected - drawn).max() > 1.0
    assert lowered.min() < -0.01


def test_the_head_does_not_move_the_features(
    world: World, setup: Setup, solution: Solution
) -> None:
    still = make_world(head_moves=False)
    mesh = still.rig.meshes[0]
    steady = replace(setup, head="stabilised")
    points = setup.binding.points
    calm, _ = solve_take(
        still.take, mesh.points[points], mesh.offsets_at(points), mesh.shape_names, steady
    )
    nodding = features(chin("take"), world.take, mesh, setup, solution.weights, solution)
    resting = features(chin("take"), still.take, mesh, steady, calm.weights, calm)
    np.testing.assert_allclose(nodding, resting, atol=1e-3)


def test_a_weights_take_has_no_markers_of_its_own(world: World, setup: Setup) -> None:
    take = WeightsTake(world.rig.shape_names, world.take.times, world.weights)
    mesh = world.rig.meshes[0]
    with pytest.raises(InputError, match='"character"'):
        features(chin("take"), take, mesh, setup, take, None)
    assert features(chin("character"), take, mesh, setup, take, None).shape == (40, 1)


def test_express_raises_the_pose_by_what_the_rule_says() -> None:
    inputs = np.array([[0.0], [-5.0], [-40.0]])
    weights = np.array([[0.0, 0.3], [0.0, 0.3], [0.9, 0.3]])
    joy = Expression("joy", ("smile", "squint"), np.array([0.8, 0.4]), gain=0.5)
    corrected, emotions, findings = express(
        chin("take", normalisation="all_rules", neutral_rule=True),
        inputs,
        ("smile", "jaw"),
        weights,
        [joy],
    )
    np.testing.assert_allclose(
        emotions["joy"], [0.0, 0.25, 1.0]
    )  # 0.25: half-way through the response
    np.testing.assert_allclose(corrected, [[0.0, 0.3], [0.2, 0.3], [0.9, 0.3]])
    assert [(f.code, f.where) for f in findings] == [("SHAPE_UNKNOWN", "squint")]


def test_an_emotion_without_a_pose_is_said_and_changes_nothing() -> None:
    weights = np.full((2, 1), 0.25)
    corrected, emotions, findings = express(
        chin("take"), np.array([[0.0], [-40.0]]), ("smile",), weights, []
    )
    np.testing.assert_array_equal(corrected, weights)
    assert emotions["joy"].max() == 1
    assert [(f.code, f.where) for f in findings] == [("EXPRESSION_UNKNOWN", "joy")]


def test_the_designed_system_hears_each_expression_it_has_a_rule_for(
    world: World, setup: Setup
) -> None:
    mesh = world.rig.meshes[0]
    expressions, _ = expressions_for(mesh.shape_names)
    system, playing, _ = design(mesh, setup, expressions, CorrectionOptions())
    assert system is not None
    poses = np.array([e.pose(mesh.shape_names) for e in expressions])
    take = WeightsTake(mesh.shape_names, np.arange(len(poses), dtype=float), poses)
    inputs = features(system, take, mesh, playing, take, None)
    _, emotions, _ = express(system, inputs, mesh.shape_names, poses, expressions)
    for row, expression in enumerate(expressions):
        assert emotions[expression.name][row] > 0.4, expression.name


def test_the_papers_system_works_in_a_shot(world: World, tmp_path: Path) -> None:
    world.write(tmp_path, roles=ROLES)
    shot = tmp_path / "shot.usda"
    files = ["--rig", tmp_path / "rig.usda", "--take", tmp_path / "take.usda"]
    command = ["shot", *files, "--bind", tmp_path / "bind.json", "-o", shot]
    assert main([str(a) for a in command]) == 0
    stage = Usd.Stage.Open(str(shot))
    stage.RemovePrim("/Shot/Fuzzy")
    write_fuzzy(stage, "/Shot/Fuzzy", paper_system(face_unit="marker_spread"))
    stage.Save()
    assert main(["process", str(shot), "--report", str(tmp_path / "report.json")]) == 0
    found = {f["code"] for f in json.loads((tmp_path / "report.json").read_text())["findings"]}
    # As printed, the paper's system answers anger on a neutral face.
    assert "RULE_FIRES_AT_NEUTRAL" in found
    root = tmp_path / "shot.usdface.usda"
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "shot.usdface" / "express.usdc"))
    curves = {
        emotion: [
            layer.QueryTimeSample(f"/Shot/Fuzzy.usdface:emotion:{emotion}", code)
            for code in range(40)
        ]
        for emotion in EMOTIONS
    }
    assert curves["anger"][0] == 1 and max(curves["joy"]) == 0 <= min(curves["anger"])
    weights = animation_of(root).weights
    assert weights.min() >= 0 and weights.max() <= 1
    assert len(MEDIUM) == 13
