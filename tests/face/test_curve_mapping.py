import numpy as np
import pytest

from usdface.errors import InputError
from usdface.face.curve_mapping import rename_weights, undecided
from usdface.takes import WeightsTake


def take(**curves: float) -> WeightsTake:
    return WeightsTake(tuple(curves), np.array([0.0]), np.array([list(curves.values())]))


def test_one_curve_drives_both_sides_and_two_drive_their_mean() -> None:
    source = take(BrowInnerUp=0.5, CheekPuffLeft=0.2, CheekPuffRight=0.6, JawOpen=1.05)
    names = ("browInnerUp_L", "browInnerUp_R", "cheekPuff", "jawOpen", "tongueOut")
    renamed, findings = rename_weights(source, names)
    np.testing.assert_allclose(renamed.weights, [[0.5, 0.5, 0.4, 1.0, 0.0]])
    assert [found.code for found in findings] == ["WEIGHTS_CLIPPED"]
    assert "by 0.05 at most: jawOpen" in findings[0].message


@pytest.mark.parametrize(
    ("weight", "code"), [(1.0033, "WEIGHTS_OVERSHOT"), (1.02, "WEIGHTS_CLIPPED")]
)
def test_the_overshoot_of_a_recorder_is_no_warning(weight: float, code: str) -> None:
    """Each range of motion of a phone has some: with --strict it failed."""
    renamed, (found,) = rename_weights(take(JawOpen=weight), ("jawOpen",))
    assert renamed.weights[0, 0] == 1.0 and found.code == code
    assert found.severity == ("info" if code == "WEIGHTS_OVERSHOT" else "warning")


def test_a_little_beyond_1_is_not_called_from_0_to_1() -> None:
    _, findings = rename_weights(take(EyeLookInRight=1.0033), ("eyeLookIn_R",))
    assert "by 0.0033 at most: eyeLookIn_R" in findings[0].message


def test_a_movement_that_a_rig_has_whole_and_in_halves_is_shown_once() -> None:
    """Avatars have mouthSmile beside mouthSmileLeft and mouthSmileRight."""
    names = ("mouthSmile", "mouthSmileLeft", "mouthSmileRight")
    halves, _ = rename_weights(take(MouthSmileLeft=0.4, MouthSmileRight=0.8), names)
    np.testing.assert_array_equal(halves.weights, [[0.0, 0.4, 0.8]])
    whole, _ = rename_weights(take(MouthSmile=0.5), names)
    np.testing.assert_array_equal(whole.weights, [[0.5, 0.0, 0.0]])


def test_a_jaw_that_goes_left_or_right_is_no_half_of_a_jaw() -> None:
    renamed, findings = rename_weights(take(jawOpen=0.2, jawLeft=0.8), ("jaw", "jawOpen"))
    np.testing.assert_array_equal(renamed.weights, [[0.0, 0.2]])
    assert [found.code for found in findings] == ["CHANNEL_IGNORED"]
    renamed, _ = rename_weights(take(jaw=0.8, smile=0.5), ("jawLeft", "jaw_right", "smile"))
    np.testing.assert_array_equal(renamed.weights, [[0.0, 0.0, 0.5]])
    renamed, _ = rename_weights(take(JawLeft=0.8, Mouth=0.5), ("jaw_left", "jaw_right", "mouth"))
    np.testing.assert_array_equal(renamed.weights, [[0.8, 0.0, 0.5]])


def test_names_in_other_scripts_are_told_apart() -> None:
    renamed, findings = rename_weights(take(まばたき=0.2, あ=0.8, 口角_L=0.4), ("あ", "う", "眉_L"))
    np.testing.assert_array_equal(renamed.weights, [[0.8, 0.0, 0.0]])
    assert [found.code for found in findings] == ["CHANNEL_IGNORED"]


def test_the_same_name_wins_over_the_same_spelling() -> None:
    renamed, _ = rename_weights(take(jaw_open=0.2, jawOpen=0.7), ("jawOpen",))
    assert renamed.weights[0, 0] == 0.7


def test_idle_curves_are_named() -> None:
    _, findings = rename_weights(take(jawOpen=0.2, headYaw=0.1), ("jawOpen",))
    assert [f.code for f in findings] == ["CHANNEL_IGNORED"]
    assert "headYaw" in findings[0].message


def test_names_that_match_nothing_are_refused() -> None:
    with pytest.raises(InputError) as raised:
        rename_weights(take(headYaw=0.1), tuple("abcdefg"))
    assert "curves: headYaw; blend shapes: a, b, c, d, e, f, ...; `usdface" in str(raised.value)
    assert '{"curves": {"headYaw": {"a": 1.0}}}' in str(raised.value)
    with pytest.raises(InputError, match="curves: none; blend shapes: a;"):
        rename_weights(WeightsTake((), np.arange(2.0), np.zeros((2, 0))), ("a",))


def test_curves_that_are_told_go_where_they_are_told() -> None:
    source = take(jawOpen=0.4, mouthClose=0.1, smile=0.6, Blink_L=0.5)
    named = {"jawOpen": {"mouth": 1.5, "chin": 0.5}, "mouthClose": {"mouth": -1.0}, "smile": {}}
    names = ("chin", "mouth", "jawOpen", "smile", "blinkLeft")
    renamed, findings = rename_weights(source, names, named)
    np.testing.assert_allclose(renamed.weights, [[0.2, 0.5, 0.0, 0.0, 0.5]])
    assert findings == []  # a curve that drives nothing was told to


def test_a_shape_that_is_told_is_driven_by_nothing_else() -> None:
    source = take(jawOpen=0.4, mouth=0.9)
    renamed, findings = rename_weights(source, ("mouth",), {"jawOpen": {"mouth": 0.5}})
    np.testing.assert_allclose(renamed.weights, [[0.2]])
    assert [found.code for found in findings] == ["CHANNEL_IGNORED"]


def test_a_curve_may_be_told_in_another_spelling() -> None:
    source = take(EyeBlinkLeft=0.5, eyeBlink_L=0.25)
    named = {"eyeBlinkLeft": {"lid": 1.0}}
    assert rename_weights(source, ("lid",), named)[0].weights[0, 0] == 0.5
    named = {"eyeBlink_L": {"lid": 1.0}}
    assert rename_weights(source, ("lid",), named)[0].weights[0, 0] == 0.25


def test_a_curve_that_the_take_lacks_is_a_finding_and_a_shape_that_the_rig_lacks_an_error() -> None:
    source = take(jawOpen=0.4)
    _, findings = rename_weights(source, ("jawOpen",), {"jawOpenn": {"jawOpen": 1.0}})
    assert [found.code for found in findings] == ["CURVE_UNKNOWN"]
    assert "did you mean jawOpen?" in findings[0].message
    with pytest.raises(InputError, match="'jaw', a blend shape the rig has not; did you mean"):
        rename_weights(source, ("jawOpen",), {"jawOpen": {"jaw": 1.0}})


def test_a_curve_that_takes_back_more_than_there_is_leaves_0() -> None:
    named = {"jawOpen": {"jaw": 1.5}, "mouthClose": {"jaw": -1.0}}
    renamed, findings = rename_weights(take(jawOpen=0.1, mouthClose=0.3), ("jaw",), named)
    assert renamed.weights[0, 0] == 0.0 and findings == []
    _, findings = rename_weights(take(jawOpen=1.0, mouthClose=0.3), ("jaw",), named)
    assert "by 0.2 at most: jaw" in findings[0].message
    _, findings = rename_weights(take(jaw=-0.2), ("jaw",))
    assert [found.code for found in findings] == ["WEIGHTS_CLIPPED"]


def test_undecided_is_what_is_neither_told_nor_named() -> None:
    curves = ("JawOpen", "CheekPuff", "TongueOut", "mouthLeft", "smile")
    shapes = ("jawOpen", "cheekPuff_L", "mouth", "grin", "frown")
    assert undecided(curves, shapes, {}) == (
        ("TongueOut", "mouthLeft", "smile"),
        ("mouth", "grin", "frown"),
    )
    named = {"smile": {"grin": 1.0}, "tongueOut": {}, "gone": {"frown": 1.0}}
    assert undecided(curves, shapes, named) == (("mouthLeft",), ("mouth", "frown"))


def test_a_curve_that_is_told_twice_is_refused() -> None:
    named = {"EyeBlinkLeft": {"lid": 1.0}, "eyeBlink_L": {"brow": 1.0}}
    with pytest.raises(InputError, match="'eyeBlinkLeft' is named twice, as 'EyeBlinkLeft' and"):
        rename_weights(take(eyeBlinkLeft=0.5), ("lid", "brow"), named)


def test_curves_that_drive_nothing_are_refused_with_the_reason() -> None:
    for named, reason in (
        ({"jawOpn": {"jaw": 1.0}}, "no curves of the names jawOpn; did you mean jawOpen?; curves"),
        ({"jawOpen": {}}, "drives a blend shape of the rig: curves: jawOpen"),
        ({}, "none has the name of one"),
    ):
        with pytest.raises(InputError) as raised:
            rename_weights(take(jawOpen=0.5), ("jaw",), named)
        assert reason in str(raised.value)


def test_curves_of_one_movement_are_told_apart_by_their_names() -> None:
    both = take(Mouth_Funnel_Up_L=0.2, Mouth_Funnel_Down_L=0.6)
    names = ("mouthFunnelUp_L", "mouthFunnelDown_L")
    told, _ = rename_weights(both, ("up", "down"), {names[0]: {"up": 1.0}, names[1]: {"down": 1.0}})
    np.testing.assert_allclose(told.weights, [[0.2, 0.6]])
    named, _ = rename_weights(both, names)
    np.testing.assert_allclose(named.weights, [[0.2, 0.6]])
    arkit, _ = rename_weights(take(mouthFunnel=0.4), names)
    np.testing.assert_allclose(arkit.weights, [[0.4, 0.4]])
    whole, _ = rename_weights(both, ("mouthFunnelUp",))
    np.testing.assert_allclose(whole.weights, [[0.2]])
