"""Meshopt and Draco data, made by the libraries that decode them."""

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import DracoPy
import numpy as np
import pytest
from meshoptimizer import encoder

from usdface.errors import InputError
from usdface.io.gltf import decompress as compressed
from usdface.io.gltf.check import check_gltf
from usdface.io.gltf.read import read_gltf
from usdface.pipeline import import_scene
from usdface.rigs import Mesh

RNG = np.random.default_rng(2)
POINTS = RNG.integers(0, 256, (40, 3)).astype("<f4")
POINTS[:2] = [[0, 0, 0], [255, 255, 255]]  # so that 8 bits of Draco hold all points exactly
FACES = RNG.permutation(np.r_[np.arange(40), RNG.integers(0, 40, 80)]).astype("<u4")
DELTA = RNG.normal(size=(40, 3)).astype("<f4")
KINDS = {"f4": 5126, "u4": 5125, "u2": 5123, "i1": 5120}


def glb(path: Path, document: dict, blob: bytes) -> Path:
    text = json.dumps({"asset": {"version": "2.0"}} | document).encode()
    text += b" " * (-len(text) % 4)
    blob += bytes(-len(blob) % 4)
    parts = struct.pack("<I4s", len(text), b"JSON") + text
    parts += struct.pack("<I4s", len(blob), b"BIN\0") + blob
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts)
    return path


def meshopt_glb(path: Path, name: str = "EXT_meshopt_compression", **change: object) -> Path:
    """A GLB of POINTS, FACES and one morph target, all compressed."""
    sources = [
        (POINTS, 12, "ATTRIBUTES", encoder.encode_vertex_buffer(POINTS, 40, 12)),
        (FACES, 4, "TRIANGLES", encoder.encode_index_buffer(FACES, 120, 40)),
        (DELTA, 12, "ATTRIBUTES", encoder.encode_vertex_buffer(DELTA, 40, 12)),
    ]
    blob, views, accessors = b"", [], []
    for number, (array, stride, mode, data) in enumerate(sources):
        code = {
            "buffer": 0,
            "byteOffset": len(blob),
            "byteLength": len(data),
            "byteStride": stride,
            "count": len(array),
            "mode": mode,
        }
        code |= change if number == 0 else {}
        view = {"buffer": 1, "byteOffset": 0, "byteLength": array.nbytes}
        views.append(view | {"extensions": {name: code}})
        kind = "VEC3" if array.ndim == 2 else "SCALAR"
        part = {"componentType": KINDS[array.dtype.str[1:]], "count": len(array), "type": kind}
        accessors.append({"bufferView": number} | part)
        blob += data + bytes(-len(data) % 4)
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "targets": [{"POSITION": 2}]}
    document = {
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["a"]}}],
        "bufferViews": views,
        "accessors": accessors,
        "buffers": [
            {"byteLength": len(blob)},
            {"byteLength": 4096, "extensions": {name: {"fallback": True}}},
        ],
    }
    return glb(path, document, blob)


def draco_glb(path: Path, damage: Callable[[bytes], bytes] = bytes, count: int = 40) -> Path:
    data = DracoPy.encode(POINTS, FACES.reshape(-1, 3), quantization_bits=8, preserve_order=True)
    (attribute,) = DracoPy.decode(data).attributes
    data = damage(data)
    blob = data + bytes(-len(data) % 4)
    code = {"bufferView": 0, "attributes": {"POSITION": attribute["unique_id"]}}
    name = "KHR_draco_mesh_compression"
    primitive = {
        "attributes": {"POSITION": 0},
        "indices": 1,
        "targets": [{"POSITION": 2}],
        "extensions": {name: code},
    }
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": len(data)},
        {"buffer": 0, "byteOffset": len(blob), "byteLength": DELTA.nbytes},
    ]
    document = {
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["a"]}}],
        "bufferViews": views,
        "accessors": [
            {"componentType": 5126, "count": count, "type": "VEC3"},
            {"componentType": 5123, "count": 120, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": 40, "type": "VEC3"},
        ],
        "buffers": [{"byteLength": len(blob) + DELTA.nbytes}],
    }
    return glb(path, document, blob + DELTA.tobytes())


def assert_is_the_mesh(mesh: Mesh) -> None:
    shown = [mesh.points[mesh.face_indices], mesh.offsets_at(mesh.face_indices)[0]]
    given = [POINTS[FACES], DELTA[FACES]]
    one, other = (np.concatenate(parts, 1).reshape(-1, 3, 6) for parts in (shown, given))
    np.testing.assert_allclose(turned(one), turned(other), 0, 1e-4)


def turned(triangles: np.ndarray) -> np.ndarray:
    """Triangles in one order, each from its smallest corner: codecs turn and sort them."""
    first = np.argmin(triangles[:, :, 0], axis=1)
    rows = np.stack([np.roll(t, -k, axis=0) for t, k in zip(triangles, first, strict=True)])
    flat = rows.reshape(len(rows), -1).round(6)
    return rows[np.lexsort(flat.T[::-1])]


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_is_undone(tmp_path: Path, name: str) -> None:
    path = meshopt_glb(tmp_path / "a.glb", name)
    rig, _, _ = read_gltf(path)
    assert_is_the_mesh(rig.meshes[0])
    assert [f for f in check_gltf(path) if f.severity == "error"] == []


def test_draco_is_undone(tmp_path: Path) -> None:
    path = draco_glb(tmp_path / "a.glb")
    rig, _, _ = read_gltf(path)
    assert_is_the_mesh(rig.meshes[0])
    assert [f for f in check_gltf(path) if f.severity == "error"] == []


def relisted(path: Path, change: Callable[[dict], object]) -> Path:
    """Change the JSON of a GLB in place."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    change(document)
    return glb(path, document, data[28 + size :])


@pytest.mark.parametrize("made", [meshopt_glb, draco_glb])
def test_compression_that_is_used_but_not_required_is_undone(tmp_path: Path, made) -> None:
    path = relisted(made(tmp_path / "a.glb"), lambda d: d.pop("extensionsRequired"))
    assert_is_the_mesh(read_gltf(path)[0].meshes[0])
    certificate = import_scene(path, tmp_path / "a.usda").details["certificate"]
    assert certificate["decoded_by_reader"] and certificate["bounding_diagonal_mm"] > 1e5


def test_an_unknown_compression_is_refused(tmp_path: Path) -> None:
    def other(document: dict) -> None:
        del document["extensionsRequired"]
        primitive = document["meshes"][0]["primitives"][0]
        primitive["extensions"] = {"ACME_squeezed": {"bufferView": 0}}

    path = relisted(draco_glb(tmp_path / "a.glb"), other)
    with pytest.raises(InputError, match="ACME_squeezed") as raised:
        read_gltf(path)
    assert raised.value.code == "EXTENSION_UNSUPPORTED"


@pytest.mark.slow
@pytest.mark.parametrize("made", [meshopt_glb, draco_glb])
def test_compressed_files_are_certified_and_say_how(tmp_path: Path, made: Callable) -> None:
    outcome = import_scene(made(tmp_path / "a.glb"), tmp_path / "a.usda")
    certificate = outcome.details["certificate"]
    assert certificate["decoded_by_reader"]
    assert certificate["vertex_error_max_mm"] < 1e-3
    assert not {f.code for f in outcome.findings} & {"CONVERSION_UNCERTIFIED"}


def test_octahedral_normals_are_unfolded(tmp_path: Path) -> None:
    # (x, y) and the size of the octahedron; the filter makes them unit vectors.
    raw = np.array([[127, 0, 127, 0], [0, 127, 127, 0], [0, 0, 127, 0]], "<i1")
    code = {"buffer": 0, "byteOffset": 0, "byteStride": 4, "count": 3, "mode": "ATTRIBUTES"}
    data = encoder.encode_vertex_buffer(raw, 3, 4)
    file = compressed.GltfFile.__new__(compressed.GltfFile)
    object.__setattr__(file, "buffers", (data,))
    code |= {"byteLength": len(data), "filter": "OCTAHEDRAL"}
    made = np.frombuffer(compressed._meshopt(file, code, "x"), "i1").reshape(3, 4)[:, :3]
    np.testing.assert_allclose(made / 127, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"byteLength": 10**6}, "beyond its buffer"),
        ({"byteLength": 40}, "damaged"),
        ({"count": 10**9}, "unfold from"),
        ({"count": 0}, "count 0"),
        ({"mode": "X"}, "mode 'X'"),
        ({"byteStride": 5}, "elements of 5 bytes"),
        ({"filter": "COLOR"}, "filter 'COLOR'"),
        ({"mode": "TRIANGLES", "byteStride": 4}, "40 elements of 4 bytes"),
    ],
)
def test_nonsense_of_meshopt_is_one_line(tmp_path: Path, change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_gltf(meshopt_glb(tmp_path / "a.glb", **change))


@pytest.mark.parametrize(
    ("damage", "count", "message"),
    [
        (lambda data: data[:50], 40, "damaged"),
        (lambda data: b"\0" * len(data), 40, "damaged"),
        (bytes, 41, "40 elements; the file announces 41"),
        (bytes, 10**9, "unfold from"),
    ],
)
def test_nonsense_of_draco_is_one_line(
    tmp_path: Path, damage: Callable, count: int, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_gltf(draco_glb(tmp_path / "a.glb", damage, count))


def test_a_decoder_that_ends_does_not_end_us(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text("import os; os.abort()")
    monkeypatch.setattr("usdface.io.gltf.draco._WORKER", worker)
    with pytest.raises(InputError, match="the decoder ended"):
        read_gltf(draco_glb(tmp_path / "a.glb"))


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compressed, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="EXT_meshopt_compression; install meshoptimizer"):
        read_gltf(meshopt_glb(tmp_path / "a.glb"))
    with pytest.raises(InputError, match="KHR_draco_mesh_compression; install DracoPy"):
        read_gltf(draco_glb(tmp_path / "a.glb"))


DAMAGE = """
import sys
import numpy as np
from meshoptimizer import decoder
rng = np.random.default_rng(0)
points, faces = (open(name, "rb").read() for name in sys.argv[1:])
for _ in range(3000):
    for data, run in (
        (points, lambda d: decoder.decode_vertex_buffer(40, 12, d, np.dtype("V12"))),
        (faces, lambda d: decoder.decode_index_buffer(120, 4, d)),
        (faces, lambda d: decoder.decode_index_sequence(120, 4, d)),
    ):
        damaged = bytearray(data)
        for place in rng.integers(0, len(damaged), rng.integers(1, 6)):
            damaged[place] = rng.integers(0, 256)
        try:
            run(bytes(damaged[: rng.integers(1, 2 * len(damaged))]))
        except RuntimeError:
            pass
"""


@pytest.mark.slow
def test_damaged_meshopt_data_end_no_process(tmp_path: Path) -> None:
    # Why it is decoded in this process, and Draco is not.
    (tmp_path / "points").write_bytes(encoder.encode_vertex_buffer(POINTS, 40, 12))
    (tmp_path / "faces").write_bytes(encoder.encode_index_buffer(FACES, 120, 40))
    command = [sys.executable, "-c", DAMAGE, tmp_path / "points", tmp_path / "faces"]
    assert subprocess.run(command, timeout=60).returncode == 0
