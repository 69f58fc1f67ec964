"""Words in the names of markers."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import takewhile

import numpy as np

from usdface.face.place_vocabulary import (
    AMBIGUOUS,
    IGNORED,
    IMPLIED,
    LETTERS,
    LETTERS_OF_A_SIDE,
    PARTS,
    TWOFOLD,
    WORDS,
)

__all__ = ["SIDES", "label_of", "other_side", "own_labels", "words_of"]

SIDES = {"left": 1, "right": -1}

_TOKEN = re.compile(r"[^\W_]+")
# A letter that means a side or a direction, unless all names have it and tell both sides without.
_LETTER_ALONE = re.compile(r"[^\W\d_]\d*")

# Longer names are not taken apart: no label of a marker is.
_LONGEST = 120
# Cost of a single letter, and of a word that goes on over a capital letter, against 1 for a word.
_LETTER, _OVER = 1.5, 2.0


def label_of(name: str) -> str:
    """Return the name of a marker without that of its subject."""
    return name.rsplit(":", 1)[-1][-_LONGEST:]


def own_labels(names: Sequence[str]) -> list[str]:
    """Return the labels of a set without the words that all begin or end with, as those of a take.

    Words that mean a place count, as all markers may be of the mouth.

    >>> own_labels(("Take01_LBrow", "Take01_chin")), own_labels(("M_LBrow_v2", "M_RBrow_v2"))
    (['LBrow', 'chin'], ['LBrow', 'RBrow'])
    >>> own_labels(("mouth_up", "mouth_low"))
    ['mouth_up', 'mouth_low']
    """
    labels = [label_of(name) for name in names]
    tokens = [_TOKEN.findall(label) for label in labels]
    most = min(map(len, tokens), default=1) - 1  # a word of its own is left of each
    before = _shared([own[:most] for own in tokens])
    behind = _shared([own[::-1][: most - len(before)] for own in tokens])
    rest = ["_".join(own[len(before) : len(own) - len(behind)]) for own in tokens]
    both_sides = {side for own in rest for side in words_of(own)} >= SIDES.keys()
    first, last = (_meaningless(shared, both_sides) for shared in (before, behind))
    if not first + last:
        return labels
    return ["_".join(own[first : len(own) - last]) for own in tokens]


def _shared(labels: Sequence[Sequence[str]]) -> list[str]:
    """Return the first words that are the same in all labels."""
    together = zip(*labels, strict=False)
    return [each[0] for each in takewhile(lambda each: len(set(each)) == 1, together)]


def _meaningless(words: Sequence[str], both_sides: bool) -> int:
    """Return how many of the words, from the first on, mean no place."""

    def means_none(word: str) -> bool:
        place = words_of(word) - {"head"}
        return not place or (both_sides and _LETTER_ALONE.fullmatch(word) is not None)

    return sum(1 for _ in takewhile(means_none, words))


def other_side(name: str) -> str | None:
    """Return a label with its first letter L or R exchanged, in lower case; None without one."""
    label = label_of(name).lower()
    return {"l": "r", "r": "l"}[label[0]] + label[1:] if label[:1] in ("l", "r") else None


@cache
def words_of(name: str, *, sided: bool = False) -> frozenset[str]:
    """Return the concepts of `usdface.face.place_vocabulary` in the name of a marker.

    `sided`: its first letter, L or R, is a side.

    >>> sorted(words_of("subject:RMouthCorner"))
    ['corner', 'mouth', 'right']
    >>> sorted(words_of("LOBRO")), sorted(words_of("LOBRO", sided=True))
    (['brow', 'lower'], ['brow', 'left', 'outer'])
    """
    label = label_of(name)
    plain = unicodedata.normalize("NFKD", label.replace("ß", "ss"))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    tokens = re.findall(r"[^\W\d_]+", plain)
    found: set[str] = set()
    loose: set[str] = set()
    if sided and (behind := _segmented(tokens[0][1:], LETTERS_OF_A_SIDE)):
        loose |= set(behind)
        found |= {LETTERS[tokens[0][0].lower()]}
        found |= {c for piece in behind for c in _meaning(piece, "", LETTERS_OF_A_SIDE)}
        tokens = tokens[1:]
    for token in tokens:
        camel = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", token)
        pieces = _segmented(token) or [p for each in camel for p in _segmented(each)]
        loose |= set(pieces)
        found |= {concept for piece in pieces for concept in _meaning(piece, token)}
    short = loose & set(AMBIGUOUS)
    if short and not found & set(PARTS):
        sided, numbered = bool(found & set(SIDES)), any(c.isdigit() for c in plain)
        found -= {LETTERS[piece] for piece in short if piece in LETTERS}
        found |= {AMBIGUOUS[s] for s in short if sided or (numbered and len(s) > 1)}
    if not found & set(PARTS):
        found |= {IMPLIED[concept] for concept in found if concept in IMPLIED}
    return frozenset(found)


def _meaning(piece: str, token: str, letters: Mapping[str, str] = LETTERS) -> tuple[str, ...]:
    if piece in TWOFOLD and piece == token.lower():
        return TWOFOLD[piece]
    if piece in WORDS:
        return WORDS[piece]
    return (letters[piece],) if piece in letters else ()


def _segmented(token: str, letters: Mapping[str, str] = LETTERS) -> list[str]:
    """Return the fewest known words that make up a token of letters; [] if none do.

    Single letters stand only before or behind the words, and a word that goes on over a capital
    letter counts as three: "UpR" is up and right, not "upr".
    """
    humps = [i for i in range(1, len(token)) if token[i - 1].islower() and token[i].isupper()]
    token, size = token.lower(), len(token)
    best: list[tuple[float, list[str]]] = [(0.0, []), *([(np.inf, [])] * size)]
    for end in range(1, size + 1):
        for start in range(end):
            cost, before = best[start]
            piece = token[start:end]
            outside = start == 0 or end == size or all(len(word) == 1 for word in before)
            whole = piece == token and piece in AMBIGUOUS
            if piece in WORDS or piece in IGNORED or whole or (piece in letters and outside):
                cost += 1.0 if len(piece) > 1 else _LETTER
                cost += _OVER * any(start < hump < end for hump in humps)
                if cost < best[end][0]:
                    best[end] = (cost, [*before, piece])
    return best[size][1]
