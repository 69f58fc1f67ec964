import re
from itertools import permutations

import numpy as np
import pytest

from usdface.face.expression_poses import (
    EMOTION_NAMES,
    EMOTIONS,
    ActionPose,
    expressions_for,
    units_of,
)
from usdface.face.facs_names import (
    ARKIT,
    FACS,
    MAKEHUMAN,
    NAMING_CONVENTIONS,
    UNITS,
    VRM,
    ActionUnit,
    action_unit,
)
from usdface.face.shape_names import shape_key, split_words
from usdface.setup.expression import Expression

SIDES = {"Left": "Right", "_L": "_R", "left": "right"}


def shapes_of(family, sides):
    names = [t.format(side=s) for u in family.units.values() for t in u for s in sides]
    return tuple(dict.fromkeys(names))


ARKIT_NAMES = tuple(
    "browInnerUp" if n.startswith("browInnerUp") else n for n in shapes_of(ARKIT, ("Left", "Right"))
)
RIGS = {
    "arkit": tuple(dict.fromkeys(ARKIT_NAMES)),
    "ict": shapes_of(ARKIT, ("_L", "_R")),
    "makehuman": shapes_of(MAKEHUMAN, ("left", "right")),
    "facs": tuple(f"AU{unit:02d}{side}" for unit in sorted(UNITS) for side in ("_L", "_R")),
}


def poses(shapes):
    expressions, findings = expressions_for(shapes)
    assert findings == []
    return {e.name: e.pose(shapes) for e in expressions}


@pytest.mark.parametrize("rig", RIGS)
def test_every_rig_shows_all_six(rig):
    found = poses(RIGS[rig])
    assert tuple(found) == tuple(EMOTIONS)
    assert all(pose.max() > 0.5 for pose in found.values())


@pytest.mark.parametrize("rig", RIGS)
def test_poses_are_mirror_symmetric(rig):
    shapes = RIGS[rig]
    mirrored = [re.sub("Left$|_L$|left", lambda m: SIDES[m.group()], n) for n in shapes]
    assert mirrored != list(shapes)
    for name, pose in poses(shapes).items():
        weights = dict(zip(shapes, pose, strict=True))
        for own, other in zip(shapes, mirrored, strict=True):
            assert weights[own] == weights[other], (name, own)


@pytest.mark.parametrize("rig", RIGS)
def test_poses_differ_clearly(rig):
    # Fear and surprise share 1, 2, 5 and 26 of FACS; they are the closest pair.
    found = np.array(list(poses(RIGS[rig]).values()))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    likeness = found @ found.T - np.eye(len(found))
    assert likeness.max() < 0.8


def test_the_same_face_by_either_spelling():
    arkit, ict = poses(RIGS["arkit"]), poses(RIGS["ict"])
    for name in EMOTIONS:
        by_arkit = dict(zip(RIGS["arkit"], arkit[name], strict=True))
        for shape, weight in zip(RIGS["ict"], ict[name], strict=True):
            spelled = re.sub("_L$", "Left", re.sub("_R$", "Right", shape))
            spelled = "browInnerUp" if spelled.startswith("browInnerUp") else spelled
            assert by_arkit[spelled] == weight


def test_what_makes_a_smile_and_a_fright():
    joy, *_, surprise = expressions_for(RIGS["arkit"])[0]
    assert set(joy.shapes) == {
        "cheekSquintLeft",
        "cheekSquintRight",
        "mouthSmileLeft",
        "mouthSmileRight",
    }
    assert {"jawOpen", "browInnerUp", "eyeWideLeft"} < set(surprise.shapes)
    assert not {"mouthSmileLeft", "browDownLeft"} & set(surprise.shapes)


@pytest.mark.parametrize("emotion", EMOTIONS)
@pytest.mark.parametrize("family", [ARKIT, MAKEHUMAN, FACS], ids=lambda f: f.name)
def test_every_family_of_muscles_shows_every_unit(emotion, family):
    assert set(EMOTIONS[emotion]) <= set(family.units)


def test_shapes_named_for_emotions_are_the_poses():
    expressions, findings = expressions_for(("Angry", "Surprised", "Sad"))
    assert {e.name: e.shapes for e in expressions} == {
        "sadness": ("Sad",),
        "anger": ("Angry",),
        "surprise": ("Surprised",),
    }
    assert all(e.weights.tolist() == [1.0] for e in expressions)
    assert [(f.code, f.where) for f in findings] == [
        ("EXPRESSION_UNKNOWN", e) for e in ("joy", "fear", "disgust")
    ]


@pytest.mark.parametrize("names", list(permutations(("Happy", "Joy", "joy"))))
def test_of_several_shapes_of_an_emotion_one_is_taken_in_any_order(names):
    assert expressions_for(names)[0][0].shapes == ("Joy",)


@pytest.mark.parametrize("emotion", EMOTION_NAMES)
def test_names_of_emotions_in_any_spelling(emotion):
    for word in EMOTION_NAMES[emotion]:
        for shape in (word, word.title(), word.upper(), word.replace("fclall", "Fcl_ALL_")):
            (expression,), _ = expressions_for(("jawOpen", shape))
            assert (expression.name, expression.shapes) == (emotion, (shape,))


def test_half_of_an_emotion_is_not_its_pose():
    assert expressions_for(("jawOpen", "Joy_L"))[0] == ()


def snake(name):
    return "_".join(split_words(name))


SPELLINGS = {
    "capital": lambda name: name[0].upper() + name[1:],
    "snake": snake,
    "shouted": lambda name: snake(name).upper(),
    "letter": lambda name: re.sub("_?(left|right)$", lambda m: f".{m[1][0]}", name, flags=re.I),
}


@pytest.mark.parametrize("spelling", SPELLINGS)
@pytest.mark.parametrize("rig", ["arkit", "ict", "makehuman", "vrm", "facs"])
def test_poses_and_units_are_the_same_in_any_spelling(rig, spelling):
    names = (RIGS | {"vrm": (*shapes_of(VRM, ("Left", "Right")), "happy", "angry")})[rig]
    names = tuple({shape_key(name): name for name in names}.values())  # gaze has two spellings
    spelt = tuple(map(SPELLINGS[spelling], names))
    (own, named), (other, also_told) = map(expressions_for, (names, spelt))
    assert [e.name for e in other] == [e.name for e in own] != []
    for a, b in zip(own, other, strict=True):
        np.testing.assert_array_equal(a.pose(names), b.pose(spelt))
        assert b.shapes == tuple(spelt[names.index(shape)] for shape in a.shapes)
    assert also_told == named
    units, others = units_of(names), units_of(spelt)
    assert [others.get(name) for name in spelt] == [units.get(name) for name in names]


def test_directions_are_no_sides_of_a_unit():
    names = ("mouth_left", "JawLeft", "Mouth_Right", "Mouth_Smile_L", "JawOpen")
    assert set(units_of(names)) == {"Mouth_Smile_L", "JawOpen"}
    # The eyes turn left by the outward look of the left one and the inward look of the right one.
    looks = units_of(("EYE_LOOK_OUT_L", "EYE_LOOK_IN_L", "EYE_LOOK_OUT_R", "EYE_LOOK_IN_R"))
    assert list(map(set, looks.values())) == [{61}, {61}, {62}, {62}]
    assert list(looks) == ["EYE_LOOK_OUT_L", "EYE_LOOK_IN_R", "EYE_LOOK_IN_L", "EYE_LOOK_OUT_R"]


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (("JawOpen", "jawOpen", "jaw_open"), ("jawOpen",)),  # the convention's own
        (("jaw_open", "JawOpen"), ("JawOpen",)),  # the first by the alphabet
    ],
)
def test_of_two_spellings_one_moves_the_skin(names, shown):
    gape = {"gape": ActionPose("gape", {ActionUnit(26): 1.0})}
    for order in permutations(names):
        assert expressions_for(order, gape)[0][-1].shapes == shown
        assert set(units_of(order)) == set(shown)


def test_a_shape_of_the_artist_goes_before_action_units():
    expressions, _ = expressions_for((*RIGS["arkit"], "Joy"))
    assert {e.name: len(e.shapes) for e in expressions}["joy"] == 1
    assert len(expressions) == 6


def test_missing_units_are_named():
    some = tuple(n for n in RIGS["arkit"] if not n.startswith(("mouthPress", "mouthRoll")))
    expressions, findings = expressions_for(some)
    assert [e.name for e in expressions] == list(EMOTIONS)
    assert [(f.code, f.where) for f in findings] == [("SHAPE_UNKNOWN", "anger")]
    assert "AU23" in findings[0].message
    few, findings = expressions_for(("mouthSmileLeft", "jawOpen", "browInnerUp"))
    assert [e.name for e in few] == ["joy", "surprise"]
    assert [f.where for f in findings if f.code == "EXPRESSION_UNKNOWN"] == [
        "sadness",
        "anger",
        "fear",
        "disgust",
    ]


def test_a_rig_without_known_names_shows_nothing():
    expressions, findings = expressions_for(("Key 1", "Key 2"))
    assert expressions == ()
    assert {f.code for f in findings} == {"EXPRESSION_UNKNOWN"}
    assert len(findings) == 6


def test_names_on_real_rigs(shared_data):
    icts = np.load(shared_data / "ict_facekit" / "ict_expressions.npz")["shapes"]
    targets = (shared_data / "makehuman_cc0" / "targets").glob("*.target")
    for shapes in (tuple(map(str, icts)), tuple(t.stem for t in targets)):
        assert set(poses(shapes)) == set(EMOTIONS)


MIRROR = {a: b for pair in ("Left Right", "_L _R", "left right") for a, b in [pair.split()]}
MIRROR |= {"L": "R"}
MIRROR |= {b: a for a, b in MIRROR.items()}
HALF = re.compile(r"Left$|Right$|_L$|_R$|(?<=\d)[LR]$|left|right")


def mirrored(names):
    """Return names and weights of the other half."""
    return {HALF.sub(lambda m: MIRROR[m.group()], name): weight for name, weight in names.items()}


@pytest.mark.parametrize("family", NAMING_CONVENTIONS, ids=lambda f: f.name)
@pytest.mark.parametrize("unit", sorted(set(UNITS) - {61, 62}))
def test_the_halves_of_a_unit_are_mirror_images_and_make_the_whole(family, unit):
    whole, left, right = (dict(family.names(ActionUnit(unit, side))) for side in ("", "L", "R"))
    assert mirrored(left) == right and mirrored(whole) == whole
    assert left | right == whole


@pytest.mark.parametrize(
    "spelling",
    ["AU{}", "AU{:02d}", "au{}", "AU_{:02d}", "FACS_AU{}", "AU{}_L AU{}_R", "AU{}L AU{}R"],
)
def test_a_rig_whose_shapes_are_action_units(spelling):
    """Expressions are the units as `EMOTIONS` has them."""
    names = tuple(word.format(unit) for unit in sorted(UNITS) for word in spelling.split())
    expressions, findings = expressions_for(("jaw_open", *names))
    assert findings == []
    for expression in expressions:
        for shape, weight in zip(expression.shapes, expression.weights, strict=True):
            assert weight == EMOTIONS[expression.name][int(re.search(r"\d+", shape)[0])]
        assert len(expression.shapes) == len(EMOTIONS[expression.name]) * len(spelling.split())
    assert units_of(names)[names[0]] == {1}


@pytest.mark.parametrize("family", [ARKIT, VRM], ids=lambda f: f.name)
def test_a_look_to_the_left_is_the_mirror_image_of_one_to_the_right(family):
    left, right = (dict(family.names(ActionUnit(unit))) for unit in (61, 62))
    assert left and mirrored(left) == right


def test_every_shape_of_a_family_is_one_of_its_convention(shared_data):
    icts = set(map(str, np.load(shared_data / "ict_facekit" / "ict_expressions.npz")["shapes"]))
    targets = {t.stem for t in (shared_data / "makehuman_cc0" / "targets").glob("*.target")}
    assert set(shapes_of(MAKEHUMAN, ("left", "right"))) <= targets
    for unit in ARKIT.units:
        assert icts & {name for name, _ in ARKIT.names(ActionUnit(unit))}, unit


def test_vrm_presets():
    presets = ("happy", "angry", "sad", "relaxed", "surprised", "aa", "ih", "ou", "ee", "oh")
    presets += ("blink", "blinkLeft", "blinkRight", "lookUp", "lookDown", "lookLeft", "lookRight")
    expressions, findings = expressions_for((*presets, "neutral"))
    assert {e.name: e.shapes for e in expressions} == {
        "joy": ("happy",),
        "sadness": ("sad",),
        "anger": ("angry",),
        "surprise": ("surprised",),
        "relaxed": ("relaxed",),
    }
    assert [(f.code, f.where) for f in findings] == [
        ("EXPRESSION_UNKNOWN", "fear"),
        ("EXPRESSION_UNKNOWN", "disgust"),
    ]
    wink = ActionPose("wink", {ActionUnit(43, "L"): 1.0})
    assert expressions_for(presets, {"wink": wink})[0][-1].shapes == ("blinkLeft",)
    assert units_of(presets)["aa"] == {26}


def test_what_is_given_goes_first_and_nothing_needs_a_name_that_is_known():
    rig = (*RIGS["arkit"], "Joy")
    given = {
        "joy": Expression("joy", ("jawOpen",), np.ones(1)),
        "fear": None,
        "contempt": ActionPose("contempt", {action_unit("12L"): 0.3, action_unit("AU14L"): 0.9}),
        "bliss": Expression("bliss", ("glow",), np.ones(1)),
        "moods": ActionPose("moods", {action_unit("10"): 0.5, action_unit("1L"): 0.5}, 0.7),
    }
    expressions, findings = expressions_for(rig, given)
    found = {e.name: dict(zip(e.shapes, e.weights, strict=True)) for e in expressions}
    assert tuple(found)[-4:] == ("joy", "contempt", "bliss", "moods") and "fear" not in found
    assert found["joy"] == {"jawOpen": 1.0}
    assert found["contempt"] == {"mouthSmileLeft": 0.3, "mouthDimpleLeft": 0.9}
    # A shape without a side stands for either half.
    assert found["moods"]["browInnerUp"] == 0.5 and expressions[-1].gain == 0.7
    assert [(f.code, f.where) for f in findings] == [("SHAPE_UNKNOWN", "glow")]


def test_a_pose_that_a_rig_cannot_show_is_left_out_and_said():
    pose = ActionPose("puffed", {action_unit("34"): 1.0})
    expressions, findings = expressions_for(RIGS["makehuman"], {"puffed": pose})
    assert "puffed" not in {e.name for e in expressions}
    assert [(f.code, f.where) for f in findings] == [("EXPRESSION_UNKNOWN", "puffed")]


def test_a_unit_moves_every_part_that_another_program_makes_of_its_shape():
    parts = [f"CTRL_expressions_mouthPress{part}" for part in ("UL", "DL", "UR", "DR")]
    names = (*parts, "CTRL_expressions_mouthCornerPullL", "CTRL_expressions_mouthCornerPullR")
    assert {name for name, own in units_of(names).items() if 24 in own} == set(parts)
