"""pygltflib's own reading as the judge of the faster one."""

import json
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pygltflib import GLTF2

from usdface.io.gltf.decode import decode_document
from usdface.io.gltf.write import write_gltf
from usdface.rigs import Rig

KNOWN = {
    "asset": {"version": "2.0", "generator": "a test"},
    "scene": 0.0,
    "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0, "extras": {"a": [1]}, "translation": [0, 1, 2]}, {"children": [0]}, None],
    "meshes": [
        {
            "primitives": [
                {"attributes": {"POSITION": 0, "_OWN": 1}, "targets": [{"POSITION": 2}]},
                {"attributes": {}},
            ],
            "weights": [0, 1],
            "unknown": 3,
        }
    ],
    "accessors": [
        {"componentType": 5126, "count": 2, "type": "VEC3", "min": [0], "sparse": {"count": 1}},
        {"bufferView": None, "normalized": True, "name": 7},
    ],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
    "animations": [{"channels": [{"sampler": 0, "target": {"path": "weights", "node": 0}}]}],
    "extensions": {"EXT": {"values": [1, {"b": None}]}},
}


def plain(value: Any) -> Any:
    """The value with the members of all objects, and the types of numbers."""
    if is_dataclass(value) and not isinstance(value, type):
        return type(value).__name__, {k: plain(v) for k, v in vars(value).items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    if type(value).__name__ == "Attributes":
        return vars(value)
    return type(value).__name__, value


def assert_as_pygltflib(text: str) -> None:
    assert plain(decode_document(json.loads(text))) == plain(
        GLTF2.from_json(text, infer_missing=True)
    )


def test_a_document_is_what_pygltflib_makes_of_it() -> None:
    assert_as_pygltflib(json.dumps(KNOWN))


def test_a_written_face_is_what_pygltflib_makes_of_it(tmp_path: Path, skinned_rig: Rig) -> None:
    write_gltf(skinned_rig, tmp_path / "face.gltf")
    assert_as_pygltflib((tmp_path / "face.gltf").read_text())


def test_real_files_are_what_pygltflib_makes_of_them(shared_data: Path) -> None:
    files = [*(shared_data / "gltf_morph").rglob("*.gltf")]
    assert len(files) > 3
    for file in files:
        assert_as_pygltflib(file.read_text())


def test_documents_share_nothing() -> None:
    one, other = (decode_document(json.loads(json.dumps(KNOWN))) for _ in range(2))
    one.nodes[1].children.append(5)
    one.accessors[0].max.append(1.0)
    assert other.nodes[1].children == [0]
    assert other.accessors[0].max == []
    assert asdict(decode_document({}).asset) == asdict(GLTF2.from_json("{}").asset)


@pytest.mark.parametrize(
    "values",
    [
        {"nodes": {"0": {}}},
        {"nodes": "ab"},
        {"nodes": [[]]},
        {"meshes": [{"primitives": [{"attributes": [0]}]}]},
        {"accessors": [{"count": "many"}]},
        {"accessors": [{"count": [1]}]},
        {"accessors": [{"min": [None]}]},
        {"extensions": []},
        [],
        "text",
        None,
    ],
)
def test_values_that_do_not_fit_are_refused(values: Any) -> None:
    with pytest.raises((AttributeError, TypeError, ValueError)):
        decode_document(values)


def test_infinite_counts_are_refused() -> None:
    with pytest.raises(OverflowError):
        decode_document({"accessors": [{"count": np.inf}]})
