import re

import numpy as np
import pytest

from usdface.fuzzy.dictionaries import ARKIT, EMOTIONS, FAMILIES, MAKEHUMAN, NAMED, expressions_for

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
@pytest.mark.parametrize("family", FAMILIES, ids=lambda f: f.name)
def test_every_family_shows_every_unit(emotion, family):
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


@pytest.mark.parametrize("emotion", NAMED)
def test_names_of_emotions_in_any_case(emotion):
    for word in NAMED[emotion]:
        for shape in (word, word.title(), word.upper()):
            (expression,), _ = expressions_for(("jawOpen", shape))
            assert (expression.name, expression.shapes) == (emotion, (shape,))


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
