"""The corrector between take and weights: what it adds."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chin_system import chin
from deformed import deformed
from expression_systems import expression_system
from marker_face import marker_face
from pxr import Sdf, Usd
from slits import EXPRESSIONS, slit_face
from worlds import World, animation_of, make_world

from usdface.cli import main
from usdface.correction.default_system import design
from usdface.correction.expression_layer import Correction, express
from usdface.correction.feature_extraction import Features, sided_features
from usdface.correction.gains import Gains
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.expression_poses import expressions_for
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.usd.fuzzy import write_fuzzy
from usdface.options import CorrectionOptions
from usdface.rule_design.paper_system import EMOTIONS, MEDIUM, paper_system
from usdface.setup.binding import Binding
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup
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
def setup(world: World) -> RetargetSetup:
    points = np.array(list(world.points.values()))
    return RetargetSetup(
        Binding(tuple(world.points), points), neutral=(0, 3), nose_tip="nose", roles=ROLES
    )


def test_express_raises_the_pose_by_what_the_rule_says() -> None:
    inputs = np.array([[0.0], [-5.0], [-40.0]])
    weights = np.array([[0.0, 0.3], [0.0, 0.3], [0.9, 0.3]])
    joy = Expression("joy", ("smile", "squint"), np.array([0.8, 0.4]), gain=0.5)
    result = express(
        chin("take", normalisation="all_rules", else_rule=True),
        Features({"both": inputs}),
        marker_face(),
        names=("smile", "jaw"),
        weights=weights,
        expressions=[joy],
    )
    # 0.25: two fifths of the way through the response, a share of 0.352
    np.testing.assert_allclose(result.trace.emotions["joy"], [0.0, 0.25, 1.0])
    np.testing.assert_allclose(result.trace.firing, [[0.0], [0.25], [1.0]])
    np.testing.assert_allclose(result.weights, [[0.0, 0.3], [0.1408, 0.3], [0.9, 0.3]])
    assert [(f.code, f.where) for f in result.findings] == [("SHAPE_UNKNOWN", "squint")]


def test_an_emotion_without_a_pose_is_said_and_changes_nothing() -> None:
    weights = np.full((2, 1), 0.25)
    inputs = Features({"both": np.array([[0.0], [-40.0]])})
    result = express(
        chin("take"), inputs, marker_face(), names=("smile",), weights=weights, expressions=[]
    )
    np.testing.assert_array_equal(result.weights, weights)
    assert result.trace.emotions["joy"].max() == 1
    assert [(f.code, f.where) for f in result.findings] == [("EXPRESSION_UNKNOWN", "joy")]


def test_the_designed_system_hears_each_expression_it_has_a_rule_for(
    world: World, setup: RetargetSetup
) -> None:
    mesh = world.rig.meshes[0]
    expressions, _ = expressions_for(mesh.shape_names)
    face = bound_face(mesh, setup)
    system, roles, _ = design(face, expressions, CorrectionOptions())
    assert system is not None
    face = replace(face, roles=roles)
    poses = np.array([e.pose(mesh.shape_names) for e in expressions])
    take = WeightsTake(mesh.shape_names, np.arange(len(poses), dtype=float), poses)
    inputs = sided_features(system, face, take, weights=take, solution=None, sides=["both"])
    emotions = express(
        system, inputs, face, names=mesh.shape_names, weights=poses, expressions=expressions
    ).trace.emotions
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
    write_fuzzy(stage, "/Shot/Fuzzy", replace(paper_system(), face_unit="marker_spread"))
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


SLITS = slit_face()
SIDE = {"Left": "Right", "Right": "Left"}
MIRROR = [
    SLITS.shape_names.index(next((n[: -len(s)] + SIDE[s] for s in SIDE if n.endswith(s)), n))
    for n in SLITS.shape_names
]


@pytest.fixture(scope="module")
def slits() -> tuple[ExpressionSystem, BoundFace]:
    """The system designed for the face of slits, on the vertices of its front."""
    front = np.flatnonzero(SLITS.points[:, 2] > 0.009)
    x = SLITS.points[front, 0]
    nose = int(front[np.argmin(np.abs(x) + np.abs(SLITS.points[front, 1] - 0.015))])
    names = tuple("nose" if p == nose else f"m{p}" for p in front)
    setup = RetargetSetup(Binding(names, front), nose_tip="nose")
    face = bound_face(SLITS, setup).with_layout(EXPRESSIONS)
    system, roles, _ = design(face, EXPRESSIONS, CorrectionOptions())
    assert system is not None
    return system, replace(face, roles=roles)


def loose(face: BoundFace) -> BoundFace:
    """The same without lips and lids that touch."""
    none = np.zeros((0, 2), int)
    return replace(face, layout=replace(face.layout, lips=none, lids=none))


def played(slits, weights, ease: float | None = None, gains: Gains | None = None) -> Correction:
    """Correct weights (F, S) of the face of slits."""
    system, face = slits
    system = system if ease is None else replace(system, ease=ease)
    take = WeightsTake(SLITS.shape_names, np.arange(len(weights)) / 60, weights)
    inputs = sided_features(
        system, face, take, weights=take, solution=None, sides=face.layout.sides
    )
    return corrected(system, inputs, face, weights, gains)


def corrected(system, inputs, face: BoundFace, weights, gains: Gains | None = None) -> Correction:
    return express(
        system,
        inputs,
        face,
        names=SLITS.shape_names,
        weights=weights,
        expressions=EXPRESSIONS,
        gains=gains,
    )


def weights_of(**shapes: float) -> np.ndarray:
    return np.array([[shapes.get(name, 0.0) for name in SLITS.shape_names]])


def corrected_by(slits, solved, **changes) -> dict[str, float]:
    after = played(slits, solved, **changes).weights
    return dict(zip(SLITS.shape_names, (after - solved)[0], strict=True))


def performances(frames: int) -> np.ndarray:
    rng = np.random.default_rng(5)
    poses = np.array([e.pose(SLITS.shape_names) for e in EXPRESSIONS])
    loud = rng.uniform(0, 0.8, size=(frames, 4, 1)) * (rng.uniform(size=(frames, 4, 1)) > 0.5)
    uneven = rng.uniform(0.3, 1.0, size=(frames, len(SLITS.shape_names)))
    return np.clip((loud * poses).max(axis=1) * uneven, 0, 1)


def test_a_one_sided_smile_is_corrected_on_its_side_alone(slits) -> None:
    for side, other in SIDE.items():
        changed = corrected_by(slits, weights_of(**{f"mouthSmile{side}": 0.4}))
        assert changed[f"mouthSmile{side}"] > 0.4
        assert abs(changed[f"mouthSmile{other}"]) < 0.01
    both = corrected_by(slits, weights_of(mouthSmileLeft=0.4, mouthSmileRight=0.4))
    assert both["mouthSmileLeft"] == pytest.approx(both["mouthSmileRight"], abs=1e-9)
    assert both["mouthSmileLeft"] > 0.4


def test_a_mirrored_performance_is_corrected_in_mirror_image(slits) -> None:
    weights = performances(120)
    after = played(slits, weights).weights
    assert np.abs(after - weights).max() > 0.3
    assert np.abs(after - after[:, MIRROR]).max() > 0.1  # they are not symmetric
    mirrored = played(slits, weights[:, MIRROR]).weights
    np.testing.assert_allclose(mirrored, after[:, MIRROR], atol=1e-6)


def test_contact_is_kept_and_said(slits) -> None:
    term = Term("on", "ramp", (0.0, 1.0))
    variables = Variable("a", "input", terms=(term,)), Variable("disgust", "output")
    system = expression_system(variables, (parse_rule("IF a IS on THEN disgust IS 1"),))
    system = replace(system, evidence=0.0)  # the solved weights do not match it
    names = SLITS.shape_names
    weights = np.repeat(weights_of(mouthPressLeft=0.2), 3, axis=0)
    weights[2] = weights_of(jawOpen=0.5)[0]
    inputs = Features({"both": np.array([[0.0], [1.0], [1.0]])})
    face = slits[1]
    parted, kept = (corrected(system, inputs, one, weights) for one in (loose(face), face))
    free, held = parted.weights, kept.weights
    assert "CONTACT_KEPT" not in {f.code for f in parted.findings}
    (reported,) = [f for f in kept.findings if f.code == "CONTACT_KEPT"]
    assert (
        reported.where == "lips" and "1 frame (1)" in reported.message and "mm" in reported.message
    )
    # A small limit is said, not rounded to nothing.
    gains = (replace(system, gain=gain) for gain in np.linspace(0.0, 1.0, 101))
    found = (f for one in gains for f in corrected(one, inputs, face, weights).findings)
    least = next(f for f in found if f.code == "CONTACT_KEPT")
    assert 0.0 < least.values["gap_mm"] < 0.05 and " 0.0 mm" not in least.message
    lips = face.layout.lips

    def gap(row: np.ndarray) -> float:
        upper, lower = deformed(SLITS, row)[lips].swapaxes(0, 1)
        return float((upper[:, 1] - lower[:, 1]).mean())

    assert gap(free[1]) - gap(weights[1]) > 0.003
    assert gap(held[1]) - gap(weights[1]) <= 0.0005 + 1e-6
    squint = names.index("eyeSquintLeft")  # has nothing to do with the lips
    assert held[1, squint] == free[1, squint] == 1.0
    np.testing.assert_array_equal(held[[0, 2]], free[[0, 2]])


@pytest.mark.parametrize("region", ["brows", "eyes", "mouth"])
def test_the_gain_of_a_region_is_of_its_shapes_alone(slits, region) -> None:
    weights = performances(60)
    free = slits[0], loose(slits[1])
    plain = played(free, weights).weights - weights
    none = Gains(regions={region: np.zeros(1)})
    muted = played(free, weights, gains=none).weights - weights
    own = np.isin(SLITS.shape_names, slits[1].layout.regions[region])
    assert plain[:, own].max() > 0.1 and not muted[:, own].any()
    np.testing.assert_array_equal(muted[:, ~own], plain[:, ~own])


def test_gains_over_time_count_in_their_frames(slits) -> None:
    weights = np.repeat(weights_of(mouthSmileLeft=0.4, mouthSmileRight=0.4), 4, axis=0)
    smile = SLITS.shape_names.index("mouthSmileLeft")
    full = played(slits, weights).weights[0, smile]
    curve = np.array([0.0, 0.5, 1.0, 0.7])
    for gains in (Gains(curve), Gains(emotions={"joy": curve})):
        found = played(slits, weights, gains=gains).weights[:, smile]
        np.testing.assert_allclose(found, np.maximum(0.4, curve * full), atol=1e-9)


def test_a_frown_goes_back_where_a_smile_is_raised_if_that_is_wanted(slits) -> None:
    solved = weights_of(mouthSmileLeft=0.5, mouthSmileRight=0.5, mouthFrownLeft=0.1)
    assert corrected_by(slits, solved)["mouthFrownLeft"] == 0
    assert corrected_by(slits, solved, ease=1.0)["mouthFrownLeft"] < -0.05


@pytest.mark.parametrize(
    "named",
    [
        {"left": ("nope",)},
        {"regions": {"eyes": ("nope",)}},
        {"antagonists": (("nope", "jawOpen"),)},
    ],
)
def test_a_part_that_names_no_shape_of_the_rig_is_said(slits, named) -> None:
    system, face = slits
    face = replace(face, layout=replace(face.layout, **named))
    findings = played((system, face), weights_of(jawOpen=0.5)).findings
    reported = {(f.code, f.where) for f in findings if f.code == "SHAPE_UNKNOWN"}
    assert ("SHAPE_UNKNOWN", "nope") in reported
    assert "SHAPE_UNKNOWN" not in {f.code for f in played(slits, weights_of(jawOpen=0.5)).findings}


def test_correcting_twice_is_correcting_once_where_the_face_shows_the_pose(slits) -> None:
    system, face = slits
    poses = np.array([e.pose(SLITS.shape_names) for e in EXPRESSIONS])
    weights = (np.linspace(0.3, 0.9, 20)[:, None, None] * poses).reshape(-1, poses.shape[1])
    take = WeightsTake(SLITS.shape_names, np.arange(len(weights)) / 60, weights)
    inputs = sided_features(system, face, take, weights=take, solution=None)

    def once(solved: np.ndarray, ease: float) -> np.ndarray:
        easing = replace(system, ease=ease)
        return corrected(easing, inputs, loose(face), solved).weights

    for ease in (0.0, 0.6):
        first = once(weights, ease)
        assert np.abs(first - weights).max() > 0.3
        np.testing.assert_allclose(once(first, ease), first, atol=1e-12)


def test_correcting_again_goes_no_way_back(slits) -> None:
    system, face = slits
    weights = performances(80)
    take = WeightsTake(SLITS.shape_names, np.arange(80) / 60, weights)
    inputs = sided_features(system, face, take, weights=take, solution=None)
    first = corrected(system, inputs, loose(face), weights).weights
    assert (first >= weights).all()
    assert (corrected(system, inputs, loose(face), first).weights >= first).all()


def test_the_correction_is_a_continuous_function_of_the_solved_weights(slits) -> None:
    poses = 0.5 * np.array([e.pose(SLITS.shape_names) for e in EXPRESSIONS])
    course = np.linspace(0, 1, 501)[:, None]
    largest = 0.0
    for pose in poses:
        for other in poses:
            weights = pose + course * (other - pose)
            change = played((slits[0], loose(slits[1])), weights).weights - weights
            largest = max(largest, np.abs(change).max())
            assert np.abs(np.diff(change, axis=0)).max() < 0.05
    assert largest > 0.4
