import pytest

from usdface.face.shape_names import shape_key, whole_and_halves


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("mouthSmile_L", ("mouthsmile", "left")),
        ("MouthSmileLeft", ("mouthsmile", "left")),
        ("mouth_smile_l", ("mouthsmile", "left")),
        ("mouthSmile_R", ("mouthsmile", "right")),
        ("mouth_smile_LFT", ("mouthsmile", "left")),
        ("mouthSmile_rgt", ("mouthsmile", "right")),
        ("lf_mouthSmile", ("mouthsmile", "left")),
        ("mouthSmileRT", ("mouthsmile", "right")),
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


@pytest.mark.parametrize(
    ("names", "both"),
    [
        (("mouthSmile", "mouthSmileLeft", "mouthSmile_R", "jawOpen"), {"mouthsmile"}),
        (("mouthSmile", "mouthSmileLeft"), set()),
        (("mouthSmile_L", "mouthSmile_R"), set()),
        ((), set()),
    ],
)
def test_movements_of_which_a_rig_has_the_whole_and_both_halves(
    names: tuple[str, ...], both: set[str]
) -> None:
    assert whole_and_halves(names) == both
