"""Names of blend shapes without the words that a studio puts before or behind all of them.

``M_jawOpen_v2``, ``CHR_face_browDown_L_geo`` and ``head_bs_jawOpen`` are read as ``jawOpen`` and
``browDown_L``. Such words are those of the set, as no name alone tells them from a movement's own:
they count only if more of the names become known without them, and none means another movement.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import product
from types import MappingProxyType

from usdface.face.emotion_names import EMOTION_NAMES
from usdface.face.facs_names import FACS, NAMING_CONVENTIONS, ActionUnit
from usdface.face.place_vocabulary import PARTS
from usdface.face.shape_aliases import bare_name
from usdface.face.shape_names import SIDE_WORDS, shape_key, spelling_key, split_words
from usdface.findings import Finding, finding
from usdface.rigs import Rig

__all__ = ["plain_names", "report_affixes", "shape_keys"]

# Nearly all names have the words: rigs have a few helpers of other names. Set by hand.
_SHARE = 0.75
# Words before and behind a name.
_MOST = 4
_NAMED = 3  # names that a message lists

# ARKit's names that no action unit has.
_OF_NO_UNIT = ("jawLeft", "jawRight", "mouthLeft", "mouthRight", "mouthClose", "mouthShrugUpper")

_Words = tuple[str, ...]


def plain_names(names: Sequence[str]) -> Mapping[str, str]:
    """Return each of a set of names without a prefix and a suffix that nearly all of them share.

    Names that are known as they are, and sets that share no words, keep their spelling.

    >>> dict(plain_names(("M_jawOpen_v2", "M_mouthSmile_v2_L", "M_horns_v2")))
    {'M_jawOpen_v2': 'jaw_open', 'M_mouthSmile_v2_L': 'mouth_smile_l', 'M_horns_v2': 'horns'}
    >>> dict(plain_names(("mouthOpen", "mouthPout")))
    {'mouthOpen': 'mouthOpen', 'mouthPout': 'mouthPout'}
    """
    return _plain_names(tuple(names))


def shape_keys(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the `shape_key` of each of a set of names, without the words that they share.

    >>> shape_keys(("Hero__mouthSmile_L", "Hero__jawOpen"))
    [('mouthsmile', 'left'), ('jawopen', '')]
    """
    plain = plain_names(names)
    return [shape_key(plain[name]) for name in names]


def report_affixes(rig: Rig) -> list[Finding]:
    """Return SHAPE_NAMES_AFFIXED where names of a rig are known without words that they share."""
    plain = plain_names(rig.shape_names)
    changed = [name for name in rig.shape_names if plain[name] != name]
    if not changed:
        return []
    message = (
        "{shape_count} blend shapes are read without words that they share: {shapes} as {names}"
    )
    some = changed[:_NAMED]
    values = len(changed), some, [plain[name] for name in some]
    return [finding("SHAPE_NAMES_AFFIXED", rig.face().path, message, *values)]


@lru_cache(maxsize=64)
def _plain_names(names: tuple[str, ...]) -> Mapping[str, str]:
    best = {name: name for name in names}
    most = _known_count(best)
    if len(best) > 1:
        for stripped in (*_candidates(best, bare_name), *_candidates(best, str)):
            count = _known_count(stripped.values())
            if count > most and not _contradicted(stripped):
                best, most = stripped, count
    return MappingProxyType(best)


def _candidates(names: Iterable[str], own_name: Callable[[str], str]) -> Iterator[dict[str, str]]:
    """Return the names without some of the words that they share, the fewest words first."""
    words = {name: tuple(split_words(own_name(name))) for name in names}
    cores = [_without_sides(own) for own in words.values()]
    before = _shared([core[:_MOST] for core in cores])
    behind = _shared([core[::-1][:_MOST] for core in cores])
    lengths = product(range(len(before) + 1), range(len(behind) + 1))
    for first, last in sorted(lengths, key=sum)[1:]:
        affixes = before[:first], behind[:last]
        yield {name: _stripped(name, own, *affixes) for name, own in words.items()}


def _shared(names: Sequence[_Words]) -> _Words:
    """Return the first words that nearly all names share and that mean no movement."""
    shared: list[str] = []
    while True:
        begun = [w for w in names if w[: len(shared)] == tuple(shared) and len(w) > len(shared)]
        counts = Counter(words[len(shared)] for words in begun)
        word, count = counts.most_common(1)[0] if counts else ("", 0)
        if count < max(_SHARE * len(names), 1) or word in _meaning_words():
            return tuple(shared)
        shared.append(word)


def _stripped(name: str, words: _Words, before: _Words, behind: _Words) -> str:
    """Return a name without those words; as it is where it lacks them or has no others."""
    core = _without_sides(words)
    first = len(before) if core[: len(before)] == before else 0
    last = len(behind) if core[::-1][: len(behind)] == behind else 0
    if not first + last or len(core) <= first + last:
        return name
    kept = iter(range(len(core)))
    return "_".join(w for w in words if w in SIDE_WORDS or first <= next(kept) < len(core) - last)


def _without_sides(words: Iterable[str]) -> _Words:
    return tuple(word for word in words if word not in SIDE_WORDS)


def _contradicted(stripped: Mapping[str, str]) -> bool:
    """Return whether a known name would mean another movement, or two names the same one."""
    own, plain = ([spelling_key(name) for name in each] for each in (stripped, stripped.values()))
    changed = (a != b and _is_known(n) for n, a, b in zip(stripped, own, plain, strict=True))
    return len(set(plain)) < len(set(own)) or any(changed)


def _known_count(names: Iterable[str]) -> int:
    return sum(_is_known(name) for name in names)


def _is_known(name: str) -> bool:
    return shape_key(name) in _known_keys()


@cache
def _known_keys() -> frozenset[tuple[str, str]]:
    """Return the `shape_key` of all known names, but for VRM's vowels, which letter anything."""
    keys = {shape_key(name) for name in (*_known_names(), *_OF_NO_UNIT)}
    return frozenset((base, side) for base, side in keys if len(base) > 1)


@cache
def _meaning_words() -> frozenset[str]:
    """Return words that tell a movement from others: no prefix, though all names have them."""
    own = {word for name in _known_names(FACS.name) for word in split_words(name) if len(word) > 1}
    own |= {*PARTS, *SIDE_WORDS, "teeth", "tongue"}
    return frozenset(own | {f"{word}s" for word in own} | {word.removesuffix("s") for word in own})


def _known_names(without: str = "") -> Iterable[str]:
    """Return the names of all naming conventions but one, and of emotions."""
    for convention in NAMING_CONVENTIONS:
        if convention.name != without:
            for unit in convention.units:
                yield from (name for name, _ in convention.names(ActionUnit(unit)))
    for words in EMOTION_NAMES.values():
        yield from words
