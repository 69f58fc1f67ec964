import base64
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pygltflib
import pytest

from usdface.errors import InputError
from usdface.io.gltf.document import GltfFile
from usdface.io.gltf.image import pixels_of
from usdface.io.gltf.materials import read_materials
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.rigs import Material, Mesh, Rig, Texture


def png(path: Path, value: float, channels: int = 3) -> bytes:
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), oiio.ImageSpec(4, 4, channels, "uint8"))
    target.write_image(np.full((4, 4, channels), value, np.float32))
    target.close()
    return path.read_bytes()


def rig_with(*materials: Material) -> Rig:
    points, up = np.eye(3), np.full((3, 3), np.sqrt(1 / 3))
    meshes = [
        Mesh(m.name, points, [3], [0, 1, 2], up, points[:, :2], material=m.name) for m in materials
    ]
    return Rig("r", tuple(meshes), None, materials)


def bytes_of(texture: Texture | None) -> bytes:
    assert texture is not None
    return texture.data if texture.data is not None else Path(texture.path).read_bytes()


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_materials_come_back(tmp_path: Path, suffix: str, validate_gltf) -> None:
    first, second = png(tmp_path / "a.png", 0.2), png(tmp_path / "b.png", 0.9)
    shine = Texture(data=second, suffix=".png", space="raw", channel="g")
    full = Material(
        "skin é",
        (0.5, 0.25, 0.125),
        0.5,
        0.75,
        0.25,
        (0.5, 0.0, 1.0),
        True,
        alpha_mode="blend",
        base_color_texture=Texture(data=first, suffix=".png"),
        normal_texture=Texture(str(tmp_path / "b.png")),
        metallic_texture=replace(shine, channel="b"),
        roughness_texture=shine,
        occlusion_texture=Texture(data=first, suffix=".png"),
        emissive_texture=Texture(data=second, suffix=".png"),
    )
    plain = Material("plain", opacity=1.0)
    path = tmp_path / f"out dir/a b{suffix}"
    assert write_gltf(rig_with(full, plain), path) == []
    assert validate_gltf(path)["issues"]["numErrors"] == 0
    rig, _, found = read_gltf(path)
    assert found == []
    assert rig.materials[1] == plain
    back = rig.materials[0]
    slots = list(full.textures)
    assert slots == list(back.textures)
    for slot in slots:
        assert bytes_of(getattr(back, slot)) == bytes_of(getattr(full, slot))
    none = dict.fromkeys(slots)
    assert replace(back, **none) == replace(full, **none)
    # two different images, however many slots use them
    images = list(path.parent.glob("a b_textures/*.png"))
    assert len(images) == (2 if suffix == ".gltf" else 0)


def test_a_converted_colour_and_the_same_image_as_data_are_two(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), oiio.ImageSpec(4, 4, 3, "half"))
    target.write_image(np.full((4, 4, 3), 0.5, np.float32))
    target.close()
    texture = Texture(str(path))
    material = Material("m", base_color_texture=texture, normal_texture=texture)
    found = write_gltf(rig_with(material), tmp_path / "a.glb")
    assert [f.code for f in found] == ["TEXTURE_CONVERTED"] * 2
    back = read_gltf(tmp_path / "a.glb")[0].materials[0]
    assert bytes_of(back.base_color_texture) != bytes_of(back.normal_texture)


def test_an_image_has_the_name_of_its_file(tmp_path: Path) -> None:
    png(tmp_path / "skin 4K.png", 0.5)
    png(tmp_path / "lips.png", 0.25)
    skin = Material("a", base_color_texture=Texture(str(tmp_path / "skin 4K.png")))
    lips = Texture(str(tmp_path / "lips.png"), image_name="Lips")
    write_gltf(rig_with(skin, Material("b", base_color_texture=lips)), tmp_path / "a.glb")
    written = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert [image.name for image in written.images] == ["skin 4K", "Lips"]


def test_a_missing_texture_is_left_out(tmp_path: Path, validate_gltf) -> None:
    material = Material("m", base_color_texture=Texture(str(tmp_path / "none.png")))
    found = write_gltf(rig_with(material), tmp_path / "a.glb")
    assert [f.code for f in found] == ["TEXTURE_MISSING"]
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
    assert read_gltf(tmp_path / "a.glb")[0].materials[0].base_color_texture is None


def test_values_outside_gltfs_range_are_clamped(tmp_path: Path, validate_gltf) -> None:
    found = write_gltf(rig_with(Material("m", (5.0, 0, 0))), tmp_path / "a.glb")
    assert [f.code for f in found] == ["FEATURE_DROPPED"]
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
    assert read_gltf(tmp_path / "a.glb")[0].materials[0].base_color == (1, 0, 0)


def textured(tmp_path: Path, **parts: object) -> GltfFile:
    info = pygltflib.TextureInfo(index=0)
    pbr = pygltflib.PbrMetallicRoughness(baseColorTexture=info)
    fields = {
        "materials": [pygltflib.Material(pbrMetallicRoughness=pbr)],
        "textures": [pygltflib.Texture(source=0)],
        "images": [pygltflib.Image(uri="a.png")],
    }
    return GltfFile(pygltflib.GLTF2(**fields | parts), (), (b"1234",), tmp_path)


@pytest.mark.parametrize(
    ("image", "code"),
    [
        (pygltflib.Image(uri="../a.png"), "ASSET_OUTSIDE"),
        (pygltflib.Image(uri="%2E%2E/a.png"), "ASSET_OUTSIDE"),
        (pygltflib.Image(uri="link.png"), "ASSET_OUTSIDE"),
        (pygltflib.Image(uri="http://localhost/a.png"), "ASSET_OUTSIDE"),
        (pygltflib.Image(uri="none.png"), "TEXTURE_MISSING"),
        (pygltflib.Image(uri="pipe.png"), "TEXTURE_MISSING"),
        (pygltflib.Image(), "TEXTURE_MISSING"),
    ],
)
def test_images_outside_the_folder_are_left_out(
    tmp_path: Path, image: pygltflib.Image, code: str
) -> None:
    (tmp_path / "in").mkdir()
    png(tmp_path / "a.png", 1.0)
    (tmp_path / "in" / "link.png").symlink_to(tmp_path / "a.png")
    os.mkfifo(tmp_path / "in" / "pipe.png")
    file = textured(tmp_path / "in", images=[image])
    materials, found = read_materials(file, ("m",))
    assert materials[0].base_color_texture is None
    assert [f.code for f in found] == [code]
    wider = read_materials(replace(file, asset_root=tmp_path), ("m",))[0][0].base_color_texture
    local = code == "ASSET_OUTSIDE" and not image.uri.startswith("http")
    assert (wider is not None) == local


def test_a_name_with_the_mark_of_a_udim_stands_for_no_other_files(tmp_path: Path) -> None:
    """Tiles could be links that lead anywhere."""
    png(tmp_path / "a.<UDIM>.png", 1.0)
    file = textured(tmp_path, images=[pygltflib.Image(uri="a.%3CUDIM%3E.png")])
    texture = read_materials(file, ("m",))[0][0].base_color_texture
    assert texture.path == "" and texture.data == (tmp_path / "a.<UDIM>.png").read_bytes()


def test_an_image_that_only_an_extension_holds_is_announced(tmp_path: Path) -> None:
    file = textured(tmp_path, textures=[pygltflib.Texture()])
    assert [f.code for f in read_materials(file, ("m",))[1]] == ["TEXTURE_MISSING"]


def test_image_data_stay_inside_the_buffer(tmp_path: Path) -> None:
    views = [pygltflib.BufferView(buffer=0, byteOffset=2, byteLength=3)]
    file = textured(tmp_path, images=[pygltflib.Image(bufferView=0)], bufferViews=views)
    with pytest.raises(InputError, match="beyond"):
        read_materials(file, ("m",))


@pytest.mark.parametrize("parts", [{"textures": []}, {"images": []}])
def test_references_must_exist(tmp_path: Path, parts: dict[str, object]) -> None:
    with pytest.raises(InputError, match="there is no"):
        read_materials(textured(tmp_path, **parts), ("m",))


def test_what_a_rig_cannot_hold_is_announced(tmp_path: Path) -> None:
    png(tmp_path / "a.png", 1.0, channels=4)
    file = textured(tmp_path)
    file.document.materials[0].extensions = {
        "KHR_materials_sheen": {"sheenRoughnessFactor": 0.5},
        "KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatTexture": {"index": 0}},
    }
    materials, found = read_materials(file, ("m",))
    assert [(f.code, f.message) for f in found] == [
        ("FEATURE_DROPPED", "KHR_materials_sheen is left out"),
        ("FEATURE_DROPPED", "clearcoatTexture of KHR_materials_clearcoat is left out"),
    ]
    assert materials[0].clearcoat == 1.0


def test_gltf_defaults_are_white_metal(tmp_path: Path) -> None:
    file = GltfFile(pygltflib.GLTF2(materials=[pygltflib.Material()]), (), (), tmp_path)
    assert read_materials(file, ("m",))[0] == (Material("m", (1, 1, 1), 1, 1, 1),)


@pytest.fixture
def webp(tmp_path: Path) -> bytes:
    path = tmp_path / "source.webp"
    target = oiio.ImageOutput.create(str(path))
    if target is None:
        pytest.skip("this OpenImageIO has no WebP")
    spec = oiio.ImageSpec(8, 8, 3, "uint8")
    spec.attribute("compression", "lossless")
    assert target.open(str(path), spec)
    target.write_image(np.full((8, 8, 3), 0.25, np.float32))
    target.close()
    return path.read_bytes()


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_webp_becomes_png_once_and_says_so(
    tmp_path: Path, webp: bytes, beside: bool, named: bool
) -> None:
    uri = "data:image/webp;base64," + base64.b64encode(webp).decode()
    if beside:
        (tmp_path / "a.webp").write_bytes(webp)
        uri = "a.webp"
    texture = pygltflib.Texture(source=None if named else 0)
    if named:
        texture.extensions = {"EXT_texture_webp": {"source": 0}}
    file = textured(tmp_path, images=[pygltflib.Image(uri=uri)], textures=[texture])
    first = file.document.materials[0]
    file.document.materials.append(first)
    (one, other), found = read_materials(file, ("m", "n"))
    assert [f.code for f in found] == ["TEXTURE_CONVERTED"]
    assert one.base_color_texture == other.base_color_texture
    assert one.base_color_texture.suffix == ".png"
    pixels = pixels_of(one.base_color_texture)
    assert np.abs(pixels.astype(int) - 64).max() <= 3  # of 255: it may be lossy


def test_where_webp_is_damaged_the_other_image_serves(tmp_path: Path, webp: bytes) -> None:
    png(tmp_path / "a.png", 1.0)
    (tmp_path / "a.webp").write_bytes(webp[:-6])
    texture = pygltflib.Texture(source=0)
    texture.extensions = {"EXT_texture_webp": {"source": 1}}
    images = [pygltflib.Image(uri="a.png"), pygltflib.Image(uri="a.webp")]
    file = textured(tmp_path, images=images, textures=[texture])
    (material,), found = read_materials(file, ("m",))
    assert [f.code for f in found] == ["TEXTURE_MISSING"]
    assert material.base_color_texture.path.endswith("a.png")
