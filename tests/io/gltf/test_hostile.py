"""Damaged and hostile GLBs: a coded error or a whole result, in little memory."""

import copy
import json
import resource
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checkout import CHECKOUT, environment

from usdface.clips import Clip
from usdface.errors import ERROR_CODES, InputError, UsdFaceError
from usdface.io.gltf.document import load_document
from usdface.io.gltf.write import write_gltf
from usdface.pipeline import import_scene
from usdface.rigs import Rig
from usdface.takes import WeightsTake

HOSTILE = (
    -1,
    0,
    1,
    7,
    255,
    2**31,
    2**40,
    1.5,
    1e308,
    True,
    None,
    "x",
    "../x",
    [],
    {},
    [0],
    {"a": 0},
)
MEBIBYTE = 2**20


@pytest.fixture
def good(skinned_rig: Rig, tmp_path: Path) -> bytes:
    """A GLB with skin, shapes, an inbetween and an animation; in a file, too."""
    rig, path = skinned_rig, tmp_path / "good.glb"
    times = np.arange(8) / 30
    weights = np.abs(np.sin(times[:, None] + np.arange(len(rig.shape_names))))
    write_gltf(rig, path, (Clip("c", WeightsTake(rig.shape_names, times, weights, 30.0)),))
    return path.read_bytes()


def parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def glb(document: object, blob: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def leaves(node: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every place of a JSON document: its container and key."""
    for key, child in node.items() if isinstance(node, dict) else enumerate(node):
        yield node, key
        if isinstance(child, dict | list):
            yield from leaves(child)


def hostile(data: bytes, seed: int, count: int) -> Iterator[bytes]:
    """Yield damaged files: cut off, with changed bytes, with a wrong value in the JSON."""
    rng = np.random.default_rng(seed)
    document, blob = parts(data)
    size = len(data) - len(blob)
    for number in range(count):
        kind = number % 8
        if kind == 0:
            yield data[: rng.integers(len(data))]
        elif kind == 1:
            changed = bytearray(data)
            for place in rng.integers(size, size=3):
                changed[place] = rng.integers(256)
            yield bytes(changed)
        elif kind == 2:
            numbers = bytearray(blob)
            place = 4 * int(rng.integers(len(blob) // 4))
            wild = np.array([np.nan, np.inf, 3e38, -1e30, 1e-45], "<f4")
            numbers[place : place + 4] = rng.choice(wild).tobytes()
            yield glb(document, bytes(numbers))
        else:
            changed_document = copy.deepcopy(document)
            places = list(leaves(changed_document))
            container, key = places[rng.integers(len(places))]
            container[key] = HOSTILE[rng.integers(len(HOSTILE))]
            yield glb(changed_document, blob)


def convert(folder: Path, seed: int, count: int) -> tuple[int, int]:
    """Convert damaged files; return how many were refused, and bytes of memory they took."""
    source, result = folder / "a.glb", folder / "out" / "a.usda"
    data = (folder / "good.glb").read_bytes()
    import_scene(folder / "good.glb", result)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refused = 0
    for number, damaged in enumerate(hostile(data, seed, count)):
        result.unlink(missing_ok=True)
        source.write_bytes(damaged)
        try:
            import_scene(source, result)
            assert result.exists()
        except UsdFaceError as error:
            refused += 1
            assert error.code in ERROR_CODES and error.code != "INPUT_UNUSABLE", (number, error)
            assert "\n" not in str(error) and str(source) in str(error), (number, error)
            assert not result.exists()
        assert {p.name for p in result.parent.glob("*")} <= {result.name, "textures"}
    took = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return refused, 1024 * took


@pytest.mark.slow
@pytest.mark.usefixtures("good")
def test_damaged_files_are_refused_with_a_code_or_converted_whole(tmp_path: Path) -> None:
    refused, _ = convert(tmp_path, 1, 120)
    assert 40 < refused < 120


@pytest.mark.slow
@pytest.mark.usefixtures("good")
@pytest.mark.parametrize("seed", [2])
def test_they_take_little_memory(tmp_path: Path, seed: int) -> None:
    """In a process of its own, whose peak is no other test's."""
    command = [sys.executable, __file__, str(tmp_path), str(seed), "800"]
    own = environment(CHECKOUT / "tests")
    done = subprocess.run(command, capture_output=True, text=True, env=own, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    refused, took = map(int, done.stdout.split()[-2:])
    assert refused > 300
    assert took < 64 * MEBIBYTE


def test_a_json_of_countless_objects_is_not_taken_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_text('{"asset":{"version":"2.0"},"nodes":[' + "{}," * 2**18 + "{}]}")
    with pytest.raises(InputError, match="objects") as caught:
        load_document(path)
    assert caught.value.code == "TOO_LARGE"


def test_what_unfolds_beyond_its_bytes_is_refused(tmp_path: Path, good: bytes) -> None:
    """A thousand targets that are one array take its bytes once, and 12 million numbers."""
    document, blob = parts(good)
    many, size = len(document["accessors"]), 12 * 4000
    view = {"buffer": 0, "byteOffset": len(blob), "byteLength": size}
    document["bufferViews"].append(view)
    document["buffers"][0]["byteLength"] = len(blob) + size
    blob = blob + b"\x3f" * size
    stored = {"bufferView": len(document["bufferViews"]) - 1, "componentType": 5126}
    document["accessors"].append(stored | {"count": 4000, "type": "VEC3"})
    document["meshes"][0]["primitives"] = [
        {"attributes": {"POSITION": many}, "targets": [{"POSITION": many}] * 1000}
    ]
    (tmp_path / "b.glb").write_bytes(glb(document, blob))
    with pytest.raises(InputError, match="scene unfolds") as caught:
        import_scene(tmp_path / "b.glb", tmp_path / "b.usda")
    assert caught.value.code == "TOO_LARGE"


if __name__ == "__main__":
    print(*convert(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])))
