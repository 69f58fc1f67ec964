import numpy as np
import pytest

from usdface.errors import InputError
from usdface.face.shape_names import rename_weights, shape_key
from usdface.takes import WeightsTake


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("mouthSmile_L", ("mouthsmile", "left")),
        ("MouthSmileLeft", ("mouthsmile", "left")),
        ("mouth_smile_l", ("mouthsmile", "left")),
        ("mouthSmile_R", ("mouthsmile", "right")),
        ("jawOpen", ("jawopen", "")),
        ("mouthLeft", ("mouth", "left")),
        ("L_browDown", ("browdown", "left")),
        ("LeftBrowDown", ("browdown", "left")),
        ("eyebrows-left-inner-up", ("eyebrowsinnerup", "left")),
        ("eye-right-slit", ("eyeslit", "right")),
        ("leftRight", ("left", "right")),
        ("lip_r_up", ("liprup", "")),
        ("L", ("l", "")),
        ("Tür", ("tür", "")),
        ("Mundöffnen_L", ("mundöffnen", "left")),
        ("Mundo\u0308ffnen_L", ("mundöffnen", "left")),  # as macOS writes it
        ("BocaFeliz_ñ", ("bocafelizñ", "")),
        ("口角_R", ("口角", "right")),
        ("", ("", "")),
    ],
)
def test_spelling_does_not_count(name: str, key: tuple[str, str]) -> None:
    assert shape_key(name) == key


def take(**curves: float) -> WeightsTake:
    return WeightsTake(tuple(curves), np.array([0.0]), np.array([list(curves.values())]))


def test_one_curve_drives_both_sides_and_two_drive_their_mean() -> None:
    source = take(BrowInnerUp=0.5, CheekPuffLeft=0.2, CheekPuffRight=0.6, JawOpen=1.05)
    names = ("browInnerUp_L", "browInnerUp_R", "cheekPuff", "jawOpen", "tongueOut")
    renamed, findings = rename_weights(source, names)
    np.testing.assert_allclose(renamed.weights, [[0.5, 0.5, 0.4, 1.0, 0.0]])
    assert [found.code for found in findings] == ["WEIGHTS_CLIPPED"]
    assert "by 0.05 at most: jawOpen" in findings[0].message


def test_a_little_beyond_1_is_not_called_from_0_to_1() -> None:
    _, findings = rename_weights(take(EyeLookInRight=1.0033), ("eyeLookIn_R",))
    assert "by 0.0033 at most: eyeLookIn_R" in findings[0].message


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
    assert "curves: headYaw; blend shapes: a, b, c, d, e, f, ...; rename" in str(raised.value)
    assert "ARKit's names" in str(raised.value)
