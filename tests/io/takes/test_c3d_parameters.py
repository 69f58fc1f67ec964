import struct
from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.c3d_parameters import floats, read_parameters

FILE = Path("take.c3d")
GROUP = b"\x05\xffPOINT" + struct.pack("<H", 3) + b"\0"


def section(*records):
    return b"\0\0\x01\x54" + b"".join(records) + bytes(2)


def record(name, kind, shape, data, group=1):
    body = struct.pack("<bB", kind, len(shape)) + bytes(shape) + data + b"\0"
    return struct.pack("<bb", len(name), group) + name + struct.pack("<H", len(body) + 2) + body


def test_numbers_and_texts():
    found = read_parameters(
        FILE,
        section(
            record(b"RATE", 4, (), struct.pack("<f", 60)),  # before its group is named
            GROUP,
            record(b"Used", 2, (), struct.pack("<H", 40_000)),
            record(b"BITS", 1, (3,), bytes([1, 2, 255])),
            record(b"LABELS", -1, (4, 2), b"Chinn\xe4s "),
            record(b"EMPTY", -1, (0, 3), b""),
            record(b"LOST", 2, (1,), b"\1\0", group=9),
        ),
        "intel",
    )
    assert found["POINT:RATE"].tolist() == [60]
    assert found["POINT:USED"].tolist() == [40_000]
    assert found["POINT:BITS"].tolist() == [1, 2, 255]
    assert found["POINT:LABELS"] == ["Chin", "näs"]
    assert found["POINT:EMPTY"] == []
    assert found["9:LOST"].tolist() == [1]


def test_floats_of_three_machines():
    values = np.array([0.0, 1.0, -118.625, 1e-3], np.float32)
    assert floats(values.astype("<f4").tobytes(), "intel").tolist() == values.tolist()
    assert floats(values.astype(">f4").tobytes(), "mips").tolist() == values.tolist()
    # VAX F by hand: 1.0 is sign 0, exponent 129, fraction 0; -118.625 = -0.926757812 * 2**7
    vax = bytes([0, 0, 0, 0]) + bytes([0x80, 0x40, 0, 0]) + bytes([0xED, 0xC3, 0, 0x40])
    assert floats(vax, "dec").tolist() == [0.0, 1.0, -118.625]


@pytest.mark.parametrize(
    "damaged",
    [
        record(b"LABELS", -1, (255, 255, 255), b"short"),
        record(b"LABELS", -1, (255,) * 7, b"short"),
        record(b"LABELS", 3, (1,), b"abc"),
        record(b"LABELS", 2, (1,) * 8, b"ab"),
        b"\x06\x01LABELS",
        b"\x7f\x01LA",
        b"\x06\x01LABELS\x20\x00\x04\xff\x01",
    ],
)
def test_a_length_beyond_the_section_is_refused(damaged):
    with pytest.raises(InputError, match=r"take\.c3d: the C3D parameter .* beyond its section"):
        read_parameters(FILE, section(GROUP, damaged).rstrip(b"\0"), "intel")
