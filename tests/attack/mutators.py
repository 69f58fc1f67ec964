"""Ways to spoil a file: bytes, lengths, tokens and structure."""

import json
import random
import re
import struct
from collections.abc import Callable
from typing import Any

__all__ = ["CLASSES", "spoilt"]

_NUMBERS = (
    b"nan inf -inf 1e999 -1e999 1e39 -1e39 1e308 0 -1 -0 1 2147483647 2147483648 4294967295 "
    b"-2147483649 99999999999999999999 1e-400 0.1.2 0x10 1e9 007"
).split()
_WORDS = [b"", b"\0", b"\n", b"\r", b"\x1b[31m", b"\xff\xfe", "\u202e\u2028ä".encode(), b'"', b"'"]
_WORDS += [b"{", b"}", b"[", b"]", b"(", b")", b"<", b">", b",", b";", b":", b"/", b"../../x", b"@"]
_WORDS += [b"null", b"true", b"{}", b"[]", b"-", b"#", b"A" * 5000, b" ", b"\t", b"%s%n"]
_WORDS += [b"/dev/zero", b"../secret.png", b"../secret.bin", b"@../secret.usda@"]
_VALUES = [
    None,
    True,
    {},
    [],
    "",
    0,
    -1,
    1.5,
    2**31,
    2**63,
    1e300,
    -1e39,
    "\x1b]0;x\x07",
    "a" * 5000,
]
_VALUES += ["../secret.png", "../secret.bin", "/dev/zero", [0] * 40, {"a": {"a": []}}, [[]], "0"]
_TOKEN = re.compile(rb"[A-Za-z_]\w*|[-+]?\d[\d.eE+-]*|\S")
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")

Mutator = Callable[[bytes, random.Random], bytes]


def spoilt(data: bytes, rng: random.Random, kind: str) -> tuple[bytes, str]:
    """Return a file of `kind` (text, json, binary, glb) with one to four faults.

    And of which class the first of them is.
    """
    first = ""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        if kind == "glb" and rng.random() < 0.6 and len(data) > 20:
            mutator = rng.choice(_KINDS["json"])
            data = _with_json(data, rng, mutator)
        else:
            mutator = rng.choice(_KINDS[kind])
            data = mutator(data, rng)
        first = first or CLASSES[mutator]
    return data, first


def _with_json(data: bytes, rng: random.Random, mutator: Mutator) -> bytes:
    """Spoil the JSON of a GLB alone, and put right the lengths around."""
    (size,) = struct.unpack_from("<I", data, 12)
    text, rest = data[20 : 20 + size], data[20 + size :]
    text = mutator(text, rng)
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + rest
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _place(data: bytes, rng: random.Random) -> int:
    # Headers and tables of contents are small, and worth more than what they describe.
    if rng.random() < 0.3:
        return rng.randrange(min(len(data), 512) + 1)
    if rng.random() < 0.2:
        return max(0, len(data) - rng.randrange(512))
    return rng.randrange(len(data) + 1)


def _flip(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 4, 32))):
        if changed:
            changed[min(_place(data, rng), len(changed) - 1)] = rng.randrange(256)
    return bytes(changed)


def _integer(data: bytes, rng: random.Random) -> bytes:
    form, most = rng.choice((("<B", 8), ("<H", 16), (">H", 16), ("<I", 32), (">I", 32), ("<Q", 64)))
    choices = (0, 1, 2**most - 1, 2 ** (most - 1), 2 ** (most - 1) - 1, rng.randrange(2**most))
    number = struct.pack(form, rng.choice(choices))
    place = _place(data, rng) // len(number) * len(number)
    return data[:place] + number + data[place + len(number) :]


def _real(data: bytes, rng: random.Random) -> bytes:
    number = rng.choice((float("nan"), float("inf"), -float("inf"), 1e38, -1e30, 1e-45, 1e20))
    packed = struct.pack(rng.choice(("<f", "<d")), number)
    place = _place(data, rng) // 4 * 4
    return data[:place] + packed + data[place + len(packed) :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: _place(data, rng)]


def _drop(data: bytes, rng: random.Random) -> bytes:
    place = _place(data, rng)
    return data[:place] + data[place + rng.choice((1, 2, 8, 100, 1000)) :]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    place, size = _place(data, rng), rng.choice((1, 8, 100, 1000))
    return data[:place] + data[place : place + size] * rng.choice((2, 3, 50)) + data[place + size :]


def _splice(data: bytes, rng: random.Random) -> bytes:
    one, two, size = _place(data, rng), _place(data, rng), rng.choice((4, 64, 1024))
    return data[:one] + data[two : two + size] + data[one + size :]


def _word(data: bytes, rng: random.Random) -> bytes:
    place = _place(data, rng)
    return data[:place] + rng.choice(_WORDS) + data[place:]


def _number(data: bytes, rng: random.Random) -> bytes:
    return _exchanged(data, rng, _NUMBER, _NUMBERS)


def _token(data: bytes, rng: random.Random) -> bytes:
    return _exchanged(data, rng, _TOKEN, [*_WORDS, *_NUMBERS])


def _swap(data: bytes, rng: random.Random) -> bytes:
    start = _place(data, rng)
    found = _TOKEN.search(data, start)
    other = _TOKEN.search(data, _place(data, rng))
    if not found or not other:
        return data
    return data[: found.start()] + other[0] + data[found.end() :]


def _exchanged(
    data: bytes, rng: random.Random, pattern: re.Pattern[bytes], by: list[bytes]
) -> bytes:
    found = pattern.search(data, _place(data, rng)) or pattern.search(data)
    if not found:
        return data
    return data[: found.start()] + rng.choice(by) + data[found.end() :]


def _line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True) or [b""]
    one, two = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(4)
    if kind == 0:
        del lines[one]
    elif kind == 1:
        lines.insert(two, lines[one])
    elif kind == 2:
        lines[one], lines[two] = lines[two], lines[one]
    else:
        lines[one] = b"".join(rng.choice((lines[one], lines[two])) for _ in range(20))
    return b"".join(lines)


def _nest(data: bytes, rng: random.Random) -> bytes:
    opened, closed = rng.choice(((b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b'{"a":', b"}")))
    place, depth = _place(data, rng), rng.choice((3, 100, 20_000))
    return data[:place] + depth * opened + rng.choice((b"", b"1", depth * closed)) + data[place:]


def _tree(data: bytes, rng: random.Random) -> bytes:
    """Change one place of a JSON document: another value, another place's, none, or one more."""
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):  # no JSON any more
        return _token(data, rng)
    places = list(_places_of(document)) if isinstance(document, dict | list) else []
    if not places:
        return _token(data, rng)
    holder, key = rng.choice(places)
    other, other_key = rng.choice(places)
    kind = rng.randrange(5)
    if kind == 0:
        del holder[key]
    elif kind == 1:
        holder[key] = json.loads(json.dumps(other[other_key]))
    elif kind == 2 and isinstance(holder, list):
        holder += [holder[key]] * rng.choice((1, 50))
    elif kind == 3 and isinstance(holder[key], int | float):
        holder[key] += rng.choice((-1, 1, 2, 256, 2**31))
    else:
        holder[key] = rng.choice(_VALUES)
    return json.dumps(document).encode("utf-8", "surrogatepass")


def _places_of(value: Any) -> Any:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in items:
        yield value, key
        if isinstance(inner, dict | list):
            yield from _places_of(inner)


_BINARY = (_flip, _flip, _integer, _integer, _real, _cut, _drop, _repeat, _splice, _word)
_TEXT = (_number, _number, _token, _token, _swap, _line, _cut, _drop, _repeat, _word, _flip, _nest)
_KINDS: dict[str, tuple[Mutator, ...]] = {
    "binary": _BINARY,
    "glb": _BINARY,
    "text": _TEXT,
    "json": (*_TEXT, *8 * (_tree,)),
}
CLASSES: dict[Mutator, str] = {
    **dict.fromkeys((_flip, _real, _word), "bytes"),
    **dict.fromkeys((_integer, _cut, _drop, _repeat), "lengths"),
    **dict.fromkeys((_number, _token, _swap), "tokens"),
    **dict.fromkeys((_splice, _line, _nest, _tree), "structure"),
}
