from pathlib import Path

import pytest
from composed import GLTF, compose

from usdface.errors import OutputError
from usdface.io.gltf.document import save_document
from usdface.io.gltf.external_files import (
    check_gltf_name,
    external_files,
    generator_of,
    may_be_gltf,
)


def test_buffers_and_images_in_the_folder_are_found(tmp_path: Path) -> None:
    compose(tmp_path)
    (tmp_path.parent / "outside.png").write_bytes(b"")
    assert external_files(tmp_path / "face.gltf") == [tmp_path / name for name in GLTF[1:]]


@pytest.mark.parametrize("name", ["a.glb", "a.vrm"])
def test_glb_has_its_json_in_the_first_chunk(tmp_path: Path, name: str) -> None:
    import pygltflib

    (tmp_path / "my skin.png").write_bytes(b"")
    document = pygltflib.GLTF2(images=[pygltflib.Image(uri="my%20skin.png")])
    save_document(document, [b"1234"], {}, tmp_path / "a.glb")
    (tmp_path / "a.glb").rename(tmp_path / name)
    assert may_be_gltf(tmp_path / name)
    assert external_files(tmp_path / name) == [tmp_path / "my skin.png"]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"glTF",
        b"glTF" + bytes(20),
        b"glTF\2\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff",
        b"{",
        b"[]",
    ],
)
def test_what_cannot_be_understood_names_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.gltf").write_bytes(content)
    assert external_files(tmp_path / "a.gltf") == []
    assert not may_be_gltf(tmp_path / "none.gltf") and not may_be_gltf(tmp_path)


def test_entries_of_other_types_are_passed_by(tmp_path: Path) -> None:
    text = '{"buffers": 3, "images": [4, {"uri": 5}, {"uri": "a\\u0000b"}, {}, null]}'
    (tmp_path / "a.gltf").write_text(text)
    assert external_files(tmp_path / "a.gltf") == []


def test_the_generator_is_named_or_is_none(tmp_path: Path) -> None:
    for text, found in (
        ('{"asset": {"generator": "usdface 1"}}', "usdface 1"),
        ('{"asset": {}}', ""),
        ('{"asset": 7}', ""),
        ("[]", ""),
        ("notes", ""),
        ("glTF", ""),
    ):
        (tmp_path / "a.gltf").write_text(text)
        assert generator_of(tmp_path / "a.gltf") == found
    assert generator_of(tmp_path / "none.glb") == ""


def test_a_gltf_is_named_as_one() -> None:
    check_gltf_name(Path("a.GLB"))
    with pytest.raises(OutputError, match=r"a.fbx: a glTF file ends in .glb or .gltf"):
        check_gltf_name(Path("a.fbx"))
