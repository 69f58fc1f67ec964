"""What the expression layer must show, through the real solve, on eight faces with markers.

`python benchmarks/expressions.py` prints the figures behind the bounds.
"""

from pathlib import Path

import numpy as np
import pytest
from face_answers import (
    AMOUNTS,
    Weak,
    contact,
    loudest_alone,
    one_sided,
    others_heard,
    range_of_motion,
    sweep,
)
from face_answers import weak_expressions as weak
from faces import FACES, Face, make_face

from usdface.io.expressions_file import read_expressions_file

EXPRESSIONS = Path(__file__).resolve().parents[1] / "examples" / "expressions"
# Both halves of a smile are joy, those of a wrinkled nose disgust: units 12 and 9 of FACS. Half of
# that nose is on ICT, and much of MakeHuman's mouth, which has few blend shapes.
ALONE = {"mouthSmile": "joy", "noseSneer": "disgust"}
MAKEHUMAN = ("mouth-",)
# Where one more movement is another emotion: few markers and few blend shapes tell least.
VARIED = {"makehuman": 0.035, "makehuman68": 0.03}
LOUDEST = dict.fromkeys(("ict41", "makehuman", "makehuman41", "example68", "example41"), 0.95)
LOUDEST |= {"example": 0.95, "makehuman68": 0.65}
# The solve explains another person's dropped jaw by lips, too, rolled and lowered by 0.4 and 0.3;
# on the example's own markers by a jaw that goes forward. Nothing lowers these.
SHARE = {("example68", "surprise"): 0.8, ("example", "surprise"): 0.65}
# A correction that is 1.26 times as large as the solved weights, which MakeHuman's few blend shapes
# keep small of another person, is as rough as they are (1.02, 1.02).
ROUGHEST = {"makehuman": 1.05, "makehuman41": 1.05}
# Which faces are played in the default run.
QUICK = "example"
SLOW = tuple(kind for kind in FACES if kind != QUICK)


@pytest.fixture(
    scope="module", params=[QUICK, *(pytest.param(k, marks=pytest.mark.slow) for k in SLOW)]
)
def face(request: pytest.FixtureRequest) -> tuple[str, Face]:
    shared = Path() if request.param == "example" else request.getfixturevalue("shared_data")
    return request.param, make_face(request.param, shared)


@pytest.fixture(scope="module")
def weakened(face: tuple[str, Face]) -> Weak:
    return weak(face[1])


@pytest.mark.slow
def test_an_expression_is_heard_as_loud_as_it_is(face: tuple[str, Face]) -> None:
    _, made = face
    for emotion, detected in sweep(made).items():
        assert detected.right == 1.0, emotion
        assert detected.error <= 0.1, emotion
        assert detected.fall <= 0.05, emotion
        assert detected.rest <= 0.02, emotion


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "files"), [("ict41", ("vrm",)), ("makehuman", ("contempt", "plutchik"))]
)
def test_a_smile_is_joy_beside_expressions_that_contain_most_of_it(
    shared_data: Path, kind: str, files: tuple[str, ...]
) -> None:
    given = {
        name: pose
        for file in files
        for name, pose in read_expressions_file(EXPRESSIONS / f"{file}.json").items()
    }
    joy = sweep(make_face(kind, shared_data, given))["joy"]
    assert joy.right == 1.0
    # Their rules share the smile.
    assert joy.error <= 0.45


@pytest.mark.slow
def test_jitter_is_no_emotion(face: tuple[str, Face]) -> None:
    _, made = face
    detected = made.play(np.zeros((1200, len(made.mesh.shapes)))).emotions
    assert detected.mean(axis=0).max() <= 0.02
    assert detected.max() <= 0.1


def test_no_shape_alone_is_an_emotion(face: tuple[str, Face]) -> None:
    kind, made = face
    for shape, detected in loudest_alone(made).items():
        loud = {emotion for emotion, output in detected.items() if output > 0.35}
        if kind.startswith("makehuman") and shape.startswith(MAKEHUMAN):
            continue
        assert loud <= {e for name, e in ALONE.items() if shape.startswith(name)}, shape


def test_one_more_movement_makes_no_other_emotion_of_an_expression(
    face: tuple[str, Face],
) -> None:
    kind, made = face
    detected = others_heard(made)
    assert (detected > 0.35).mean() <= VARIED.get(kind, 0.02)
    assert detected.max() <= LOUDEST.get(kind, 0.65)


@pytest.mark.slow
def test_a_range_of_motion_is_hardly_ever_an_emotion_and_hardly_moved(
    face: tuple[str, Face], shared_data: Path
) -> None:
    kind, made = face
    if kind.startswith("makehuman"):
        pytest.skip("the recorded curves are ARKit's; MakeHuman has other shapes")
    played = made.play(*range_of_motion(made, shared_data))
    assert (played.emotions > 0.5).mean(axis=0).max() <= (0.13 if kind == "example41" else 0.05)
    change = np.abs(played.corrected - played.solved)
    assert change.mean() <= 0.02
    largest = change.max(axis=1)
    assert (largest > 0.3).mean() <= 0.02 and (largest > 0.1).mean() <= 0.1


@pytest.mark.slow
def test_a_weak_expression_comes_half_way_and_neutral_stays(
    face: tuple[str, Face], weakened: Weak
) -> None:
    for emotion, shares in weakened.share.items():
        assert len(shares) == len(AMOUNTS)
        assert max(shares) <= SHARE.get((face[0], emotion), 0.5), emotion
    assert weakened.neutral <= 0.001
    assert weakened.jump <= 0.15


@pytest.mark.slow
def test_the_correction_does_not_flicker(face: tuple[str, Face], weakened: Weak) -> None:
    assert weakened.roughness <= ROUGHEST.get(face[0], 1.0)


def test_a_correction_opens_no_closed_lips_or_lids_and_crosses_none(face: tuple[str, Face]) -> None:
    _, made = face
    found = contact(made)
    tolerance = 1000 * made.bound.layout.tolerance + 0.01
    assert found.opened["lips"][0] > 5 and found.opened["lids"][0] > 1  # without the limit
    for seam in ("lips", "lids"):
        assert found.opened[seam][1] <= tolerance
        assert found.crossed[seam][1] <= tolerance


@pytest.mark.slow
def test_half_an_expression_is_corrected_on_its_half(face: tuple[str, Face]) -> None:
    kind, made = face
    sides = one_sided(made)
    # MakeHuman's mouth has no halves, and its eyes and brows alone are no expression.
    assert (sides.own > 0.3) == ("makehuman" not in kind)
    assert sides.other <= 0.01
    assert sides.mirror <= 0.01
