import pytest

from usdface.face.marker_name_words import other_side, words_of


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("LBrow1", "left brow"),
        ("actor:LBrow1", "left brow"),
        ("Mouth_UpR1", "mouth upper right"),
        ("Mouth_Lend", "mouth left end"),
        ("LMC", "left mouth corner"),
        ("UpLip", "upper lip"),
        ("LLLip", "left lower lip"),
        ("LLip", "lip"),  # the left, or the lower
        ("rLipLowerOuter", "right lip lower outer"),
        ("lEyelidUpperInner", "left lid upper inner"),
        ("TNOSE", "nose tip"),
        ("RNSTRL", "right nostril"),
        ("LC1", "left cheek"),
        ("CH2", "chin"),
        ("browL", "brow left"),
        ("brow.L.001", "brow left"),
        ("eye brow-left", "eye brow left"),
        ("Augenbraue_rechts_außen", "brow right outer"),
        ("Mundwinkel links", "mouth corner left"),
        ("sourcil_gauche_int", "brow left inner"),
        ("paupière_sup_droite", "lid upper right"),
        ("labio_superior_izq", "lip upper left"),
        ("sopracciglio_esterno_dx", "brow outer right"),
        ("sobrancelha_esquerda", "brow left"),
        ("hidari_mayu", "brow left"),
    ],
)
def test_words_are_found_in_names(name: str, words: str) -> None:
    assert words_of(name) == set(words.split())


@pytest.mark.parametrize("side", ["left", "right"])
def test_letters_behind_that_of_a_side_are_directions(side: str) -> None:
    letter = side[0].upper()
    assert words_of(f"{letter}OBRO", sided=True) == {side, "outer", "brow"}
    assert words_of(f"subject:{letter}LLid_Inner", sided=True) == {side, "lower", "lid", "inner"}
    assert words_of(f"{letter}Lip", sided=True) == {side, "lip"}
    # Without the other side of it this is the lower brow of a name.
    assert words_of("LOBRO") == {"lower", "brow"}


def test_the_other_side_of_a_label() -> None:
    names = ("a:LOBRO", "rlid", "Chin", "", "a:")
    assert [other_side(name) for name in names] == ["robro", "llid", None, None, None]
