from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import NEUTRAL as STILL
from worlds import World, make_world

from usdface.errors import InputError
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.fitted_setup import fit_setup
from usdface.io.bind_file import setup_of_json
from usdface.options import FitOptions
from usdface.progress import Progress
from usdface.rule_design.marker_roles import known_roles, marker_features
from usdface.rule_learning.labelled_takes import examples_of, feature_noise, pose_features
from usdface.rule_learning.labels import NEUTRAL, NOTHING, Label
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

TAKE = Path("take.trc")


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(head_moves=False)


@pytest.fixture(scope="module")
def setup(world: World) -> RetargetSetup:
    return fit_setup(setup_of_json(world.bind, "bind"), world.rig.meshes[0])[0]


@pytest.fixture(scope="module")
def face(world: World, setup: RetargetSetup) -> BoundFace:
    return bound_face(world.rig.meshes[0], setup)


@pytest.fixture(scope="module")
def examples(face: BoundFace, setup: RetargetSetup):
    """Examples of one take, on the face."""

    def make(take: MarkerTake | WeightsTake, *labels: Label, space="character", setup=setup):
        options = FitOptions(space=space)
        read = {"read": lambda _: (take, []), "options": options, "progress": Progress()}
        return examples_of(labels, face, setup, **read)[0]

    return make


def stretch(start: float, end: float, emotion: str = "joy", unit="frame", take=TAKE) -> Label:
    return Label(take, start, end, unit, emotion)


def test_features_of_a_stretch_are_those_of_the_pose_it_reaches(world, face, examples):
    """Markers without noise: the one labelled frame is measured exactly, in either space."""
    truth = pose_features(
        world.weights[15:16], face, marker_features(known_roles(face.markers, face.roles))
    )
    for space in ("character", "take"):
        found = examples(world.take, stretch(15, 15), space=space)
        assert found.examples.features == pytest.approx(truth, abs=1e-6)
    assert found.weights[0] == pytest.approx(world.weights[15], abs=1e-4)


def test_seconds_and_frames_name_the_same_stretch(world, examples):
    by_frame = examples(world.take, stretch(10, 20))
    by_time = examples(world.take, stretch(10 / 30, 20 / 30, unit="s"))
    assert (by_frame.examples.features == by_time.examples.features).all()


def test_a_stretch_ends_with_the_take_at_the_latest(world, examples):
    """The last frame lasts until the next would come; what goes on after it labels another take."""
    times = world.take.times
    duration = float(times[-1] + times[1])
    assert len(examples(world.take, stretch(0.5, duration, unit="s")).examples.features) == 1
    for late in (stretch(0.5, duration + 0.5, unit="s"), stretch(3, len(times))):
        with pytest.raises(InputError, match="but the take has frames 0 to"):
            examples(world.take, late)


def test_the_height_of_a_stretch_counts_not_its_ends(world, examples):
    """Neutral frames before and after change nothing."""
    size = np.linalg.norm(world.weights, axis=1)
    peak = int(size.argmax())
    whole = examples(world.take, stretch(0, len(size) - 1)).weights[0]
    assert np.linalg.norm(whole) > 0.7 * size[peak]


def test_the_stretch_called_neutral_is_the_takes_neutral(world, setup, examples):
    """The setup names frames that are not neutral; the label knows better."""
    wrong = replace(setup, neutral=(15, 15))
    rest = stretch(0, STILL - 1, NEUTRAL)
    named = examples(world.take, rest, stretch(20, 20), setup=wrong)
    right = examples(world.take, rest, stretch(20, 20))
    assert named.examples.features == pytest.approx(right.examples.features, abs=1e-9)
    assert np.abs(named.examples.features[0]).max() < 1e-6
    assert named.examples.emotions == ("", "joy")


def test_speech_and_rest_show_no_emotion(world, examples):
    found = examples(world.take, stretch(5, 9, NOTHING), stretch(20, 25, "contempt"))
    assert found.examples.names == ("contempt",)


def test_rows_go_take_by_take_whatever_the_order_of_the_labels(world, examples):
    other = Path("other.trc")
    labels = stretch(10, 12, "joy"), stretch(10, 12, "awe", take=other), stretch(20, 22, "anger")
    found = examples(world.take, *labels).examples
    assert found.emotions == ("joy", "anger", "awe")
    assert found.recordings == ("take.trc", "take.trc", "other.trc")
    assert (found.features[0] == found.features[2]).all()


def test_a_marker_hidden_through_a_stretch_is_hidden_in_the_example(world, face, setup, examples):
    positions = np.array(world.take.positions)
    chin = world.take.names.index("chin")
    positions[10:13, chin] = np.nan
    blind = replace(setup, clean=replace(setup.clean, gaps=False))
    take = replace(world.take, positions=positions)
    made = examples(take, stretch(10, 12), stretch(20, 22), space="take", setup=blind)
    seen = made.examples.features
    hidden = np.isnan(seen[0]).reshape(-1, 3)
    assert hidden[list(face.markers).index("chin")].all()
    assert hidden.sum() == 3
    assert not np.isnan(seen[1]).any()


def test_recorded_weights_can_be_labelled_too(world, face, examples):
    take = WeightsTake(face.shape_names, world.take.times, world.weights, 30.0)
    found = examples(take, stretch(15, 15))
    assert found.weights[0] == pytest.approx(world.weights[15])
    markers = examples(world.take, stretch(15, 15))
    assert found.examples.features == pytest.approx(markers.examples.features, abs=1e-5)


def test_noise_is_that_of_two_markers_and_less_after_the_solve(face):
    on_the_take, on_the_character = (feature_noise(face, s) for s in ("take", "character"))
    unit = on_the_take[0] / (np.sqrt(2) * 0.0003)
    assert (on_the_take == on_the_take[0]).all()
    assert (on_the_character <= 1.0001 * on_the_take).all()
    assert on_the_character.min() == pytest.approx(0.5 * 0.0003 * unit)
