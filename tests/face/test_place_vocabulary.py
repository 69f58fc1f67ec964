from collections import Counter

from usdface.face.place_vocabulary import (
    AMBIGUOUS,
    IGNORED,
    IMPLIED,
    LETTERS,
    PARTS,
    TWOFOLD,
    WORDS,
)


def test_words_are_lower_case_without_accents() -> None:
    for word in (*WORDS, *IGNORED, *AMBIGUOUS):
        assert word.isascii() and word.isalpha() and word.islower(), word


def test_every_word_tells_something_and_one_part_at_most() -> None:
    for word, concepts in WORDS.items():
        assert concepts and len(set(concepts)) == len(concepts), word
        parts = Counter(concept in PARTS for concept in concepts)
        assert parts[True] <= 1, word


def test_a_word_is_on_one_side_and_in_one_direction() -> None:
    for one, other in (("left", "right"), ("upper", "lower"), ("inner", "outer")):
        assert not [word for word, named in WORDS.items() if {one, other} <= set(named)]


def test_words_that_tell_no_place_tell_none() -> None:
    assert not IGNORED & set(WORDS)
    assert set(AMBIGUOUS.values()) | set(IMPLIED.values()) <= set(PARTS)
    assert set(TWOFOLD) <= set(WORDS) and all(len(letter) == 1 for letter in LETTERS)
