import base64
import json
import struct
from pathlib import Path

import pygltflib
import pytest

from usdface.errors import InputError, OutputError
from usdface.io.gltf.document import item, load_document, save_document


def write_json(path: Path, **parts: object) -> Path:
    path.write_text(json.dumps({"asset": {"version": "2.0"}} | parts))
    return path


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_what_is_saved_is_loaded(tmp_path: Path, suffix: str) -> None:
    document = pygltflib.GLTF2(nodes=[pygltflib.Node(name="口 é")])
    path = tmp_path / f"a b{suffix}"
    save_document(document, [b"123", b"45"], {"a.png": b"image"}, path)
    file = load_document(path)
    assert file.document.nodes[0].name == "口 é"
    assert file.buffers == (b"12345\0\0\0",)
    beside = {"a b.bin", "a.png"} if suffix == ".gltf" else set()
    assert {p.name for p in tmp_path.iterdir()} == {path.name, *beside}


@pytest.mark.parametrize("suffix", [".obj", "", ".bin"])
def test_the_suffix_must_be_one_of_gltf(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(OutputError, match=r"\.glb or \.gltf"):
        save_document(pygltflib.GLTF2(), b"", {}, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_an_empty_file_is_called_so(tmp_path: Path, name: str) -> None:
    (tmp_path / name).touch()
    with pytest.raises(InputError, match="is empty") as raised:
        load_document(tmp_path / name)
    assert raised.value.code == "FILE_UNREADABLE"


def test_a_document_without_data_has_no_buffer(tmp_path: Path) -> None:
    save_document(pygltflib.GLTF2(), b"", {}, tmp_path / "a.gltf")
    assert load_document(tmp_path / "a.gltf").buffers == ()
    assert not (tmp_path / "a.bin").exists()


def test_buffers_come_from_data_uris_and_files_below_the_folder(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "one two.bin").write_bytes(b"from a file")
    data = "data:application/gltf-buffer;base64," + base64.b64encode(b"inline").decode()
    path = write_json(
        tmp_path / "a.gltf",
        buffers=[
            {"uri": "sub/one%20two.bin", "byteLength": 6},
            {"uri": data, "byteLength": 6},
        ],
    )
    assert load_document(path).buffers == (b"from a", b"inline")


@pytest.mark.parametrize(
    "uri",
    [
        "../outside.bin",
        "sub/../../outside.bin",
        "%2E%2E/outside.bin",
        "{absolute}",
        "file://{absolute}",
        "http://localhost/outside.bin",
        "C:/outside.bin",
        "..\\outside.bin",
        "link.bin",
        "missing.bin",
        ".",
        "",
        "a\0b",
        "data:text/plain,abcdefgh",
        "data:application/gltf-buffer;base64,%%%%",
    ],
)
def test_nothing_outside_the_folder_is_read(tmp_path: Path, uri: str) -> None:
    outside = tmp_path / "outside.bin"
    outside.write_bytes(b"secret secret")
    folder = tmp_path / "asset"
    (folder / "sub").mkdir(parents=True)
    (folder / "link.bin").symlink_to(outside)
    uri = uri.format(absolute=outside)
    path = write_json(folder / "a.gltf", buffers=[{"uri": uri, "byteLength": 4}])
    with pytest.raises(InputError):
        load_document(path)


@pytest.mark.parametrize("length", [9, 2**40, -1, None, "x"])
def test_a_buffer_must_hold_what_it_announces(tmp_path: Path, length: object) -> None:
    (tmp_path / "b.bin").write_bytes(b"12345678")
    path = write_json(tmp_path / "a.gltf", buffers=[{"uri": "b.bin", "byteLength": length}])
    with pytest.raises(InputError):
        load_document(path)


def test_a_buffer_needs_a_source(tmp_path: Path) -> None:
    path = write_json(tmp_path / "a.gltf", buffers=[{"byteLength": 4}])
    with pytest.raises(InputError, match="neither"):
        load_document(path)


@pytest.mark.parametrize("name", ["MSFT_texture_dds", "EXT_unknown_compression", "MY_thing"])
def test_required_extensions_are_named(tmp_path: Path, name: str) -> None:
    path = write_json(tmp_path / "a.gltf", extensionsRequired=[name], extensionsUsed=[name])
    with pytest.raises(InputError, match=name):
        load_document(path)


def test_extensions_that_change_looks_or_precision_are_read(tmp_path: Path) -> None:
    names = ["KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"]
    load_document(write_json(tmp_path / "a.gltf", extensionsRequired=names))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"glTF",
        b"{",
        b"[]",
        b"null",
        b'"text"',
        b"\xff\xfe\x00",
        b'{"asset": {"version": "2.0"}, "nodes": 5}',
        b'{"asset": {"version": "2.0"}, "nodes": [5]}',
        b'{"asset": {"version": "2.0"}, "nodes": [null]}',
        b'{"asset": {"version": "2.0"}, "accessors": [{"count": NaN}]}',
        b'{"asset": {"version": "1.0"}}',
        b'{"asset": {}, "meshes": {"a": 1}}',
        b'{"a":' * 100_000,
        b"[" * 100_000,
    ],
)
def test_what_is_not_gltf_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(content)
    with pytest.raises(InputError):
        load_document(path)


def test_every_truncation_of_a_glb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    save_document(pygltflib.GLTF2(), [b"1234"], {}, path)
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError):
            load_document(path)


def test_glb_version_and_chunk_sizes(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    save_document(pygltflib.GLTF2(), [b"1234"], {}, path)
    whole = path.read_bytes()
    for place, value in ((4, 1), (12, 2**32 - 1), (16, 0)):
        path.write_bytes(whole[:place] + struct.pack("<I", value) + whole[place + 4 :])
        with pytest.raises(InputError):
            load_document(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    for path, says in ((tmp_path / "none.glb", "cannot be read"), (tmp_path, "no regular file")):
        with pytest.raises(InputError, match=says):
            load_document(path)


def test_extras_may_be_anything_and_node_weights_are_kept(tmp_path: Path) -> None:
    nodes = [{"extras": 5, "weights": [0.5]}, {"extras": ["a"]}, {"extras": {"b": 1}}]
    file = load_document(write_json(tmp_path / "a.gltf", nodes=nodes))
    assert file.node_weights == ([0.5], None, None)
    assert file.document.nodes[2].extras == {"b": 1}


def test_item_takes_no_index_from_the_end() -> None:
    assert item("ab", 1, "letter") == "b"
    for index in (-1, 2, "1", None):
        with pytest.raises(InputError, match=r"no letter .* the file has 2"):
            item("ab", index, "letter")
