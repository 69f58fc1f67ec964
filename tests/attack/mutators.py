"""Ways to spoil a file: bytes, lengths, tokens and structure."""

import random
import re
import struct

__all__ = ["spoilt"]

_NUMBERS = (
    b"nan inf -inf 1e999 -1e999 1e39 -1e39 1e308 0 -1 -0 1 2147483647 2147483648 4294967295 "
    b"-2147483649 99999999999999999999 1e-400 0.1.2 0x10 1e9 007"
).split()
_WORDS = [b"", b"\0", b"\n", b"\r", b"\x1b[31m", b"\xff\xfe", "\u202e\u2028ä".encode(), b'"', b"'"]
_WORDS += [b"{", b"}", b"[", b"]", b"(", b")", b"<", b">", b",", b";", b":", b"/", b"../../x", b"@"]
_WORDS += [
    b"null",
    b"true",
    b"{}",
    b"[]",
    b"-",
    b"#",
    b"A" * 5000,
    b" ",
    b"\t",
    b"%s%n",
    b"/dev/zero",
]
_TOKEN = re.compile(rb"[A-Za-z_]\w*|[-+]?\d[\d.eE+-]*|\S")
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def spoilt(data: bytes, rng: random.Random, binary: bool) -> bytes:
    """Return the file with one to four faults."""
    kinds = _BINARY if binary else _TEXT
    if binary and data[:4] == b"glTF" and rng.random() < 0.6:
        return _spoilt_glb(data, rng)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = rng.choice(kinds)(data, rng)
    return data


def _spoilt_glb(data: bytes, rng: random.Random) -> bytes:
    """Spoil the JSON alone, or the buffer alone, and put right the lengths around."""
    (size,) = struct.unpack_from("<I", data, 12)
    text, rest = data[20 : 20 + size], data[20 + size :]
    text = rng.choice(_TEXT)(text, rng)
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


_BINARY = (_flip, _flip, _integer, _integer, _real, _cut, _drop, _repeat, _splice, _word)
_TEXT = (_number, _number, _token, _token, _swap, _line, _cut, _drop, _repeat, _word, _flip, _nest)
