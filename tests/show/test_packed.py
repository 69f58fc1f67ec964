"""Values in a file: they come back in every bit, and nothing else is read."""

import io
import json
import random
import tracemalloc
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from usdface.content_digest import content_digest
from usdface.errors import InputError
from usdface.show.packed import UnpackError, read_packed, write_packed


@dataclass(frozen=True)
class Thing:
    values: object
    more: object = None

    def __post_init__(self) -> None:
        if self.more == "wrong":
            raise InputError("a wrong thing")


VALUE = Thing(
    (np.arange(6.0).reshape(2, 3), np.asfortranarray(np.eye(3) * np.pi), [], {"a": (1, "b", None)}),
    {"nan": float("nan"), "flags": np.array([True, False]), "n": np.int64(3), "x": np.float64(0.1)},
)


def test_a_value_comes_back_in_every_bit(tmp_path: Path) -> None:
    given = Thing("not written")
    write_packed(tmp_path / "a.npz", (VALUE, given, -0.0), [Thing], {"given": given})
    value, same, zero = read_packed(tmp_path / "a.npz", [Thing], {"given": given})
    assert same is given and str(zero) == "-0.0"
    assert content_digest(value) == content_digest(VALUE)
    assert value.values[1].flags.f_contiguous and not value.values[0].flags.writeable


@dataclass(frozen=True)
class Unknown:
    """A class that a reader does not allow."""


@pytest.mark.parametrize(
    "value", [object(), {1: 2}, np.array([None]), np.array(["text"]), Thing(Unknown())]
)
def test_what_cannot_be_kept_is_refused(tmp_path: Path, value: object) -> None:
    with pytest.raises(TypeError, match="not kept"):
        write_packed(tmp_path / "a.npz", value, [Thing], {})
    assert list(tmp_path.iterdir()) == []


def packed(folder: Path, tree: object, **arrays: bytes) -> Path:
    """A file with a tree of its own and entries of any content."""
    stream = io.BytesIO()
    np.save(stream, np.frombuffer(json.dumps(tree).encode(), np.uint8))
    with zipfile.ZipFile(folder / "a.npz", "w") as archive:
        archive.writestr("tree.npy", stream.getvalue())
        for name, data in arrays.items():
            archive.writestr(f"{name}.npy", data)
    return folder / "a.npz"


def npy(header: str) -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(16)


@pytest.mark.parametrize(
    "tree",
    [
        {},
        [],
        ["class", "Path", ["x", 1]],
        ["class", "Thing"],
        ["class", "Thing", ["values", 1], ["none", 2]],
        ["class", "Thing", ["values", 1], ["more", "wrong"]],
        ["given", "nothing"],
        ["array", "nothing"],
        ["eval", "1"],
        [["class"]],
        ["dict", 3],
    ],
)
def test_another_structure_is_refused(tmp_path: Path, tree: object) -> None:
    with pytest.raises(UnpackError):
        read_packed(packed(tmp_path, tree), [Thing], {})


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-2,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3,)}",
        "{'descr': '|O', 'fortran_order': False, 'shape': (2,)}",
        "{'descr': [('a', '|O')], 'fortran_order': False, 'shape': (2,)}",
        "__import__('os').abort()",
    ],
)
def test_an_array_that_is_not_what_it_says_is_refused(tmp_path: Path, header: str) -> None:
    path = packed(tmp_path, ["array", "a"], a=npy(header))
    tracemalloc.start()
    with pytest.raises(UnpackError):
        read_packed(path, [Thing], {})
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_compressed_entries_are_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("tree.npy", bytes(10_000_000))
    with pytest.raises(UnpackError, match="compressed"):
        read_packed(tmp_path / "a.npz", [], {})


def test_deep_nesting_is_refused(tmp_path: Path) -> None:
    tree: object = 0
    for _ in range(900):
        tree = ["tuple", tree]
    with pytest.raises(UnpackError):
        read_packed(packed(tmp_path, tree), [], {})


def test_damage_is_refused_or_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_packed(path, VALUE, [Thing], {})
    whole, wanted = path.read_bytes(), content_digest(VALUE)
    chance = random.Random(5)
    refused = 0
    for _ in range(300):
        data = bytearray(whole)
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        path.write_bytes(data if chance.random() < 0.8 else whole[: chance.randrange(len(whole))])
        try:
            assert content_digest(read_packed(path, [Thing], {})) == wanted
        except UnpackError:
            refused += 1
    assert refused > 200
