import numpy as np
import pytest
from worlds import make_world

import usdface
from usdface.face.weights_from_neutral import rest_kept, resting_frames, weights_from_neutral
from usdface.options import BindOptions
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

NAMES = ("jawOpen", "mouthSmileLeft")


def recorded() -> WeightsTake:
    """A phone's take: 0.14 of a jaw where the face rests, in frames 20 to 39."""
    weights = np.zeros((90, 2))
    weights[:, 0] = 0.14 + 0.86 * np.sin(np.linspace(0.0, 3.0, 90)) ** 2
    weights[20:40] = [0.14, 0.0]
    weights[60, 0] = 0.1
    return WeightsTake(NAMES, np.arange(90) / 30.0, weights, 30.0, source="phone.csv")


def setup(**settings: object) -> RetargetSetup:
    none = Binding((), np.zeros(0, dtype=np.int64))
    return RetargetSetup(none, neutral=(25, 34), **settings)  # type: ignore[arg-type]


def test_it_rests_in_the_neutral_frames_and_goes_as_far_as_before() -> None:
    take, findings = weights_from_neutral(recorded(), setup(neutral_removed=True))
    np.testing.assert_allclose(take.weights[20:40], 0.0, atol=1e-12)
    before = recorded().column("jawOpen")
    np.testing.assert_allclose(take.column("jawOpen"), ((before - 0.14) / 0.86).clip(0.0))
    np.testing.assert_array_equal(take.column("mouthSmileLeft"), 0.0)
    (found,) = findings
    assert found.code == "NEUTRAL_REMOVED" and list(found.values["curves"]) == ["jawOpen"]


@pytest.mark.parametrize("removed", [None, False])
def test_it_is_kept_where_nothing_says_so(removed: bool | None) -> None:
    take = recorded()
    assert weights_from_neutral(take, setup(neutral_removed=removed)) == (take, [])


def test_the_half_second_that_shows_least_is_found() -> None:
    first, last = resting_frames(recorded())
    assert 20 <= first <= last < 40 and last - first == 15
    short = WeightsTake(NAMES, np.arange(3) / 30.0, np.zeros((3, 2)))
    assert resting_frames(short) == (0, 2)


@pytest.mark.parametrize(
    ("options", "rest"),
    [
        (BindOptions(), 0.14),
        (BindOptions(neutral=(22, 36)), 0.0),
        (BindOptions(neutral="auto"), 0.0),
    ],
)
def test_frames_that_are_named_or_found_are_taken_off(options: BindOptions, rest: float) -> None:
    shot, _ = usdface.assemble_shot(make_world().rig, recorded(), binding=options)
    result = usdface.retarget(shot)
    np.testing.assert_allclose(result.weights.column("jawOpen")[30], rest, atol=1e-9)
    codes = [found.code for found in result.findings]
    assert ("NEUTRAL_REMOVED" in codes) == (rest == 0.0)


def test_curves_that_drive_nothing_say_nothing_of_the_rest() -> None:
    """As a recorder's angles of the head, in degrees: least where the mouth is open."""
    take, rig = recorded(), make_world().rig
    degrees = np.full((90, 1), 30.0)
    degrees[60:80] = 0.0
    more = WeightsTake((*NAMES, "headYawDegrees"), take.times, np.hstack([take.weights, degrees]))
    found = []
    for each in (take, more):
        shot, _ = usdface.assemble_shot(rig, each, binding=BindOptions(neutral="auto"))
        found.append((shot.setup.neutral, usdface.retarget(shot).weights.weights))
    assert found[0][0] == found[1][0]
    np.testing.assert_array_equal(found[0][1], found[1][1])
    still = WeightsTake(more.names, take.times, np.hstack([0.0 * take.weights, degrees]))
    assert "NEUTRAL_KEPT" not in [f.code for f in usdface.assemble_shot(rig, still)[1]]


def test_a_rest_that_is_kept_is_told() -> None:
    (found,) = rest_kept(recorded(), setup())
    assert found.code == "NEUTRAL_KEPT" and list(found.values["curves"]) == ["jawOpen"]
    assert rest_kept(recorded(), setup(neutral_removed=True)) == []
    quiet = WeightsTake(NAMES, np.arange(90) / 30.0, np.full((90, 2), 0.05))
    assert rest_kept(quiet, setup()) == []
