import json
import re
from dataclasses import dataclass

import numpy as np
import pytest
from marker_face import marker_face

from usdface.correction.features import face_unit, measure, smooth
from usdface.correction.pose_blend import add_poses
from usdface.correction.rule_check import check_rules
from usdface.errors import InputError
from usdface.face.expression_poses import EMOTIONS, expressions_for
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.options import FEATURE_SMOOTHING
from usdface.rule_design.design import design_system
from usdface.setup.expression import Expression

NOISE = 0.0003


@dataclass
class World:
    names: tuple
    neutral: np.ndarray
    basis: np.ndarray
    shapes: tuple
    expressions: tuple
    nose: str = "nose"

    def __post_init__(self):
        face = marker_face(self.names, self.neutral, self.basis, self.shapes, self.nose)
        self.system, self.roles, self.findings = design_system(face, self.expressions)
        self.poses = np.array([e.pose(self.shapes) for e in self.expressions])

    def answer(self, weights, jitter=0.0):
        positions = self.neutral + np.einsum("fs,smk->fmk", weights, self.basis)
        positions += jitter * np.random.default_rng(0).normal(size=positions.shape)
        unit = face_unit(self.system, self.neutral)
        inputs = measure(
            positions,
            self.neutral,
            self.names,
            self.system.features,
            self.roles,
            self.nose,
            unit,
        )
        times = np.arange(len(inputs)) / 60.0
        if jitter:
            inputs = smooth(inputs, times, FEATURE_SMOOTHING)
        return evaluate(self.system.fuzzy, inputs).outputs


def synthetic_world():
    """Brows, lids, mouth corners, lips and chin of a face about 20 cm high; 12 shapes."""
    places = {
        "nose": (0, 0, 0.12),
        "Brow L": (0.03, 0.05, 0.1),
        "Brow R": (-0.03, 0.05, 0.1),
        "Cheek L": (0.045, 0.0, 0.09),
        "Cheek R": (-0.045, 0.0, 0.09),
        "Corner L": (0.025, -0.035, 0.1),
        "Corner R": (-0.025, -0.035, 0.1),
        "Lip up": (0, -0.03, 0.11),
        "Lip low": (0, -0.04, 0.11),
        "Chin": (0, -0.08, 0.1),
    }
    moves = {
        "browUp": {"Brow": (0, 0.008, 0)},
        "browDown": {"Brow": (-0.003, -0.006, 0)},
        "cheek": {"Cheek": (0, 0.004, 0.003)},
        "smile": {"Corner": (0.008, 0.009, -0.004), "Cheek": (0, 0.002, 0.002)},
        "frown": {"Corner": (0, -0.008, 0)},
        "stretch": {"Corner": (0.009, 0, -0.003)},
        "jaw": {"Chin": (0, -0.02, -0.01), "Lip low": (0, -0.018, -0.005)},
        "press": {"Lip low": (0, 0.005, 0), "Lip up": (0, -0.002, 0)},
        "sneer": {"Lip up": (0, 0.007, 0), "Cheek": (0, 0.003, 0)},
    }
    names = tuple(places)
    shapes, basis = [], []
    for shape, marks in moves.items():
        sides = ("_L", "_R") if any(m in ("Brow", "Cheek", "Corner") for m in marks) else ("",)
        for side in sides:
            shapes.append(shape + side)
            basis.append(np.zeros((len(names), 3)))
            for mark, move in marks.items():
                sided = f"{mark} {side[1:]}" if mark in ("Brow", "Cheek", "Corner") else mark
                mirror = (-1 if side == "_R" else 1, 1, 1)
                basis[-1][names.index(sided)] = np.multiply(move, mirror)
    recipes = {
        "joy": {"cheek": 1.0, "smile": 0.9},
        "sadness": {"browUp": 0.6, "frown": 1.0},
        "anger": {"browDown": 1.0, "press": 1.0},
        "fear": {"browUp": 0.8, "stretch": 1.0},
        "disgust": {"sneer": 1.0, "browDown": 0.5},
        "surprise": {"browUp": 1.0, "jaw": 0.8},
    }
    expressions = []
    for emotion, recipe in recipes.items():
        pose = {s: recipe.get(re.sub("_[LR]$", "", s), 0.0) for s in shapes}
        pose = {s: w for s, w in pose.items() if w}
        expressions.append(Expression(emotion, tuple(pose), np.array(list(pose.values()))))
    neutral = np.array(list(places.values()), dtype=float)
    return World(names, neutral, np.array(basis), tuple(shapes), tuple(expressions))


def landmark_names():
    """The 68 landmarks in their usual order, by what they are."""
    groups = {
        "jaw": 17,
        "brow_right": 5,
        "brow_left": 5,
        "bridge": 4,
        "nostril": 5,
        "eye_right": 6,
        "eye_left": 6,
        "lip": 12,
        "lip_inner": 8,
    }
    return tuple(f"{group}_{i}" for group, count in groups.items() for i in range(count))


def ict_world(folder):
    pack = np.load(folder / "ict_expressions.npz")
    marks = json.loads((folder / "vertex_indices.json").read_text())["idx_to_landmark_verts"]
    shapes = tuple(map(str, pack["shapes"]))
    basis = np.zeros((len(shapes), len(marks), 3))
    dense = np.zeros(pack["points"].shape)
    for row, shape in zip(basis, shapes, strict=True):
        dense[:] = 0
        dense[pack[f"idx_{shape}"]] = pack[f"off_{shape}"]
        row[:] = 0.01 * dense[marks]
    neutral = 0.01 * pack["points"][marks].astype(float)
    expressions, _ = expressions_for(shapes)
    return World(landmark_names(), neutral, basis, shapes, expressions, "bridge_3")


@pytest.fixture(scope="module", params=["synthetic", "ict"])
def world(request):
    if request.param == "synthetic":
        return synthetic_world()
    return ict_world(request.getfixturevalue("shared_data") / "ict_facekit")


def test_nothing_is_doubtful(world):
    assert world.findings == []
    assert check_rules(world.system) == []
    assert world.system.emotions == tuple(EMOTIONS)
    assert len(world.system.fuzzy.rules) == 6


def test_a_pose_gives_its_own_emotion(world):
    outputs = world.answer(world.poses)
    assert np.diag(outputs).min() >= 0.9
    assert (outputs - np.diag(np.diag(outputs))).max() < 0.35


@pytest.mark.parametrize("level", [0.15, 0.25, 0.5, 0.75])
def test_part_of_a_pose_gives_about_that_much(world, level):
    outputs = world.answer(level * world.poses)
    assert (outputs.argmax(axis=1) == np.arange(6)).all()
    assert np.abs(np.diag(outputs) - level).max() < 0.05


def test_outputs_rise_with_the_pose(world):
    levels = np.linspace(0, 1, 41)
    for e, pose in enumerate(world.poses):
        curve = world.answer(levels[:, None] * pose)[:, e]
        assert (np.diff(curve) > -3e-3).all()


def test_a_neutral_face_stays_neutral(world):
    neutral = np.zeros((2000, len(world.shapes)))
    assert not world.answer(neutral[:1]).any()
    jittered = world.answer(neutral, NOISE)
    assert jittered.mean(axis=0).max() <= 0.02
    assert jittered.max() <= 0.1


def test_noise_does_not_hide_half_an_expression(world):
    for e, pose in enumerate(world.poses):
        outputs = world.answer(np.repeat(0.5 * pose[None], 300, axis=0), NOISE)
        assert (outputs.argmax(axis=1) == e).mean() > 0.95


def test_no_single_shape_is_an_emotion(world):
    """But for the wrinkled nose that is most of disgust."""
    outputs = world.answer(np.eye(len(world.shapes)))
    nose = np.array(["sneer" in name.lower() for name in world.shapes])
    assert outputs[~nose].max() < 0.35 and outputs[nose].max() <= 0.5
    assert not np.delete(outputs[nose], list(EMOTIONS).index("disgust"), axis=1).max() > 0.1


def test_correction_of_a_weak_performance_goes_towards_its_expression(world):
    weak = 0.6 * world.poses
    corrected = add_poses(weak, world.answer(weak), world.poses, np.full(6, 0.4), 1.0)
    before, after = (np.linalg.norm(w - world.poses, axis=1) for w in (weak, corrected))
    assert (after < before).all()


def test_rules_read_several_markers_by_name(world):
    for rule in world.system.fuzzy.rules:
        assert 3 <= len(rule.propositions) <= 17
        assert "MOST OF" in rule.text
        # Without the negative conditions, which stand last and may read the same features.
        text = rule.text.split(" AND NOT ")[0].split(" THEN ")[0]
        asked = parse_rule(f"{text} THEN joy IS 1")
        positive = [p.variable for p in asked.propositions if not p.hedges]
        assert len(set(positive)) == len(positive)
    assert set(world.roles.values()) <= set(world.names)
    assert set(world.roles) == {f.role for f in world.system.features}


def test_terms_say_which_way_a_marker_goes():
    world = synthetic_world()
    words = {"x": {1: "outward", -1: "inward"}, "y": {1: "raised", -1: "lowered"}}
    words["z"] = {1: "forward", -1: "back"}
    seen = 0
    for variable, read in zip(world.system.fuzzy.inputs, world.system.features, strict=True):
        assert variable.name == f"{read.role}_{read.axis}"
        marker = world.roles[read.role]
        mirror = -1 if read.axis == "x" and marker.endswith("R") else 1
        for term in variable.terms:
            foot, top = term.parameters
            assert 0 < abs(foot) < abs(top) and foot * top > 0
            assert term.name.split("_")[-1] == words[read.axis][mirror * np.sign(top)]
            seen += 1
    assert seen >= 12


def test_the_size_of_the_face_does_not_matter():
    small = synthetic_world()
    unit = face_unit(small.system, small.neutral)
    assert face_unit(small.system, 3 * small.neutral) == pytest.approx(3 * unit)
    weights = np.random.default_rng(3).uniform(size=(20, len(small.shapes)))
    expected = small.answer(weights)
    small.neutral, small.basis = 3 * small.neutral, 3 * small.basis
    np.testing.assert_allclose(small.answer(weights), expected, atol=1e-9)


def with_expressions(*expressions, markers=None):
    world = synthetic_world()
    keep = [world.names.index(m) for m in markers or world.names]
    return World(
        tuple(world.names[i] for i in keep),
        world.neutral[keep],
        world.basis[:, keep],
        world.shapes,
        expressions or world.expressions,
    )


def test_an_expression_that_no_marker_shows_gets_no_rule():
    still = Expression("boredom", ("nothing",), np.ones(1))
    world = with_expressions(*synthetic_world().expressions, still)
    assert [(f.code, f.where) for f in world.findings] == [("EXPRESSION_UNSEEN", "boredom")]
    assert world.system.emotions[-1] == "boredom"
    assert len(world.system.fuzzy.rules) == 6


def test_expressions_that_markers_cannot_tell_apart_are_named():
    world = with_expressions(markers=("nose", "Brow L", "Brow R"))
    reported = {f.where: f.message for f in world.findings}
    assert "surprise" in reported["fear"] and "sadness" in reported["fear"]
    assert {f.code for f in world.findings} == {"EXPRESSION_UNSEEN"}


def test_a_rig_with_one_shape_for_each_emotion():
    base = synthetic_world()
    names = ("Joy", "Sad", "Angry", "Afraid", "Disgusted", "Surprised")
    basis = np.einsum("es,smk->emk", base.poses, base.basis)
    expressions, _ = expressions_for(names)
    world = World(base.names, base.neutral, basis, names, expressions)
    assert np.diag(world.answer(world.poses)).min() >= 0.9
    assert not check_rules(world.system)


@pytest.mark.parametrize(
    "names", [("a b", "a-b", "1", "IF", "nose"), ("é", "口", "x.y", "A", "nose")]
)
def test_any_marker_label_gives_a_role(names):
    rng = np.random.default_rng(0)
    basis = 0.01 * rng.normal(size=(2, 5, 3))
    expressions = (Expression("joy", ("s",), np.ones(1)), Expression("fear", ("t",), np.ones(1)))
    world = World(names, rng.normal(size=(5, 3)), basis, ("s", "t"), expressions)
    assert set(world.roles.values()) <= set(names)
    assert all(role.isidentifier() for role in world.roles)


def test_no_expressions_give_an_empty_system():
    face = marker_face(("nose", "a"), np.eye(3)[:2], nose="nose")
    system, roles, findings = design_system(face, ())
    assert (system.fuzzy.rules, roles, findings) == ((), {}, [])


def test_no_nose_tip_is_refused():
    with pytest.raises(InputError, match="no nose tip"):
        design_system(marker_face(("a",), np.zeros((1, 3))), ())


@pytest.mark.slow
def test_the_order_of_the_blend_shapes_does_not_matter(world):
    """As another program exports them."""
    order = np.random.default_rng(3).permutation(len(world.shapes))
    shapes = tuple(world.shapes[i] for i in order)
    face = marker_face(world.names, world.neutral, world.basis[order], shapes, world.nose)
    system, roles, findings = design_system(face, world.expressions)
    assert (system, roles, findings) == (world.system, world.roles, world.findings)
