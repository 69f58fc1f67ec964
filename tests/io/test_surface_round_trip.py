"""Materials, textures and corner values go from glTF to USD and back, and the other way."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from pygltflib import GLTF2

from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.udim import untiled
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Placement, Texture
from usdface.rigs import BlendShape, CornerValues, MaterialSubset, Mesh, Rig


def png(path: Path, channels: int = 3, value: float = 0.25) -> Texture:
    target = oiio.ImageOutput.create(str(path))
    target.open(str(path), oiio.ImageSpec(4, 4, channels, "uint8"))
    pixels = np.full((4, 4, channels), value, np.float32)
    pixels[..., 0] = np.linspace(0, 1, 16).reshape(4, 4)
    target.write_image(pixels)
    target.close()
    return Texture(str(path))


def sheet(material: str = "") -> Mesh:
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0.0]])
    faces = np.array([0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2])
    shape = BlendShape("a", [2, 5], [[0, 0, 0.1], [0, 0.1, 0.2]])
    normals = np.tile([0.0, 0.0, 1.0], (6, 1))
    uvs = points[faces, :2]
    return Mesh("m", points, [3] * 4, faces, normals, uvs, (shape,), None, material)


def through_usd(rig: Rig, folder: Path) -> Rig:
    write_rig(rig, folder / "way.usda")
    return read_rig(folder / "way.usda")[0]


def through_gltf(rig: Rig, folder: Path) -> Rig:
    write_gltf(rig, folder / "way.glb")
    return read_gltf(folder / "way.glb")[0]


def without_images(material: Material) -> Material:
    """The material with what stays of its textures when files move."""
    return replace(
        material,
        **{
            slot: Texture(channel=t.channel, placed=t.placed)
            for slot, t in material.textures.items()
        },
    )


PLACED = Placement("st1", ("clamp", "mirror"), (9728, 9987), (2.0, 0.5), 0.75, (0.25, -0.5))


def surfaces(folder: Path) -> dict[str, Material]:
    image, clear = png(folder / "a.png"), png(folder / "b.png", 4)
    shine = replace(image, space="raw", channel="g", placed=PLACED)
    return {
        "mask": Material("m", opacity=0.5, alpha_mode="mask", alpha_cutoff=0.25),
        "blend that is opaque": Material("m", alpha_mode="blend"),
        "coat": Material("m", ior=1.25, clearcoat=0.5, clearcoat_roughness=0.25),
        "strong glow": Material("m", emissive=(4.0, 2.0, 0.0)),
        "unlit": Material("m", (0.25, 0.5, 1.0), unlit=True, double_sided=True),
        "see-through image": Material(
            "m",
            (0.5, 0.25, 1.0),
            0.5,
            alpha_mode="blend",
            base_color_texture=replace(clear, space="sRGB", placed=PLACED),
            opacity_texture=replace(clear, space="sRGB", channel="a", placed=PLACED),
        ),
        "packed": Material(
            "m",
            metallic=0.5,
            roughness=0.25,
            normal_scale=0.5,
            occlusion_strength=0.25,
            roughness_texture=shine,
            metallic_texture=replace(shine, channel="b"),
            occlusion_texture=replace(shine, channel="r"),
            normal_texture=replace(shine, channel=""),
        ),
    }


@pytest.mark.parametrize(
    "kind",
    ["mask", "blend that is opaque", "coat", "strong glow", "unlit", "see-through image", "packed"],
)
def test_a_surface_comes_back_through_either(
    tmp_path: Path, kind: str, assert_valid_usd: Callable, validate_gltf: Callable
) -> None:
    given = surfaces(tmp_path)[kind]
    mesh = sheet("m")
    assert mesh.uvs is not None
    mesh = replace(mesh, corner_values=(CornerValues("st1", mesh.uvs * 0.5),))
    rig = Rig("r", (mesh,), None, (given,))
    for way in (through_usd, through_gltf):
        (back,) = way(rig, tmp_path).materials
        assert without_images(approximately(back)) == without_images(approximately(given))
    assert_valid_usd(tmp_path / "way.usda")
    report = validate_gltf(tmp_path / "way.glb")
    assert report["issues"]["numErrors"] == 0, report


def approximately(material: Material) -> Material:
    """Numbers to six digits: USD keeps floats, and turns in degrees."""

    def rounded(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(rounded(v) for v in value)
        return round(value, 6) if isinstance(value, float) else value

    def placed(texture: Texture) -> Texture:
        at = texture.placed
        spots = {k: rounded(getattr(at, k)) for k in ("scale", "rotation", "offset")}
        return replace(texture, placed=replace(at, **spots))

    numbers = {
        slot: rounded(getattr(material, slot))
        for slot in Material.__slots__
        if not slot.endswith("_texture") and slot != "name"
    }
    textures = {slot: placed(t) for slot, t in material.textures.items()}
    return replace(material, **numbers, **textures)


def corner_rig() -> Rig:
    rng = np.random.default_rng(3)
    mesh = sheet()
    count = len(mesh.face_indices)
    tangents = np.c_[rng.normal(size=(count, 2)), np.zeros(count), rng.choice([-1, 1], count)]
    tangents[:, :2] /= np.linalg.norm(tangents[:, :2], axis=1, keepdims=True)
    held = (
        CornerValues("lightmap", rng.random((count, 2))),
        CornerValues("st2", rng.random((count, 2))),
        CornerValues("displayColor", rng.random((count, 4))),
        CornerValues("tangents", tangents),
    )
    return Rig("r", (replace(mesh, corner_values=held), sheet()))


def corners_of(mesh: Mesh) -> np.ndarray:
    """All that the corners hold, in an order that no conversion changes."""
    values = {c.name: c.values for c in mesh.corner_values} | {"": mesh.uvs}
    rows = [mesh.points[mesh.face_indices], *(values[name] for name in sorted(values))]
    return np.concatenate(rows, axis=1)


@pytest.mark.parametrize("way", [through_usd, through_gltf])
def test_corner_values_come_back(
    tmp_path: Path, way: Callable, assert_valid_usd: Callable, validate_gltf: Callable
) -> None:
    rig = corner_rig()
    back = way(rig, tmp_path)
    for one, other in zip(rig.meshes, back.meshes, strict=True):
        assert other.uv_name == one.uv_name
        assert {c.name for c in other.corner_values} >= {c.name for c in one.corner_values}
        if len(other.corner_values) == len(one.corner_values):
            np.testing.assert_allclose(corners_of(other), corners_of(one), atol=1e-6)
    if way is through_usd:
        assert_valid_usd(tmp_path / "way.usda")
    else:
        report = validate_gltf(tmp_path / "way.glb")
        assert report["issues"]["numErrors"] == 0, report


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_vertex_colours_are_those_seen(tmp_path: Path, suffix: str) -> None:
    # glTF multiplies the material's colour; what USD shows is the product.
    mesh = sheet("m")
    colours = np.random.default_rng(1).random((12, 3))
    mesh = replace(mesh, corner_values=(CornerValues("displayColor", colours),))
    shown = Material("m", (1.0, 1.0, 1.0), vertex_colours=True)
    write_gltf(Rig("r", (mesh,), None, (shown,)), tmp_path / "a.glb")
    document = GLTF2.load(str(tmp_path / "a.glb"))
    document.materials[0].pbrMetallicRoughness.baseColorFactor = [0.5, 0.25, 1.0, 1.0]
    document.save(str(tmp_path / "b.glb"))
    rig, _, _ = read_gltf(tmp_path / "b.glb")
    write_rig(rig, tmp_path / f"b{suffix}")
    back = read_rig(tmp_path / f"b{suffix}")[0]
    seen = back.meshes[0].corners("displayColor")
    np.testing.assert_allclose(seen, colours * (0.5, 0.25, 1.0), atol=1e-6)
    write_gltf(back, tmp_path / "c.glb")
    again = GLTF2.load(str(tmp_path / "c.glb"))
    assert again.materials[0].pbrMetallicRoughness.baseColorFactor == [1, 1, 1, 1]
    assert again.meshes[0].primitives[0].attributes.COLOR_0 is not None


def test_colours_that_no_material_shows_stay_behind(tmp_path: Path) -> None:
    mesh = replace(sheet("m"), corner_values=(CornerValues("displayColor", np.zeros((12, 3))),))
    found = write_gltf(Rig("r", (mesh,), None, (Material("m"),)), tmp_path / "a.glb")
    assert [f.code for f in found] == ["CHANNEL_IGNORED"]
    assert read_gltf(tmp_path / "a.glb")[0].meshes[0].corner_values == ()


def test_colours_without_a_material_are_no_metal(tmp_path: Path, validate_gltf: Callable) -> None:
    """glTF shows metal where there is no material; the one that says otherwise is none in USD."""
    colours = CornerValues("displayColor", np.linspace(0, 1, 36).reshape(12, 3))
    half = replace(
        sheet(), corner_values=(colours,), subsets=(MaterialSubset("Material", np.array([0])),)
    )
    rig = Rig("r", (half,), None, (Material("Material", vertex_colours=True),))
    write_gltf(rig, tmp_path / "a.glb")
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
    document = GLTF2.load(str(tmp_path / "a.glb"))
    plain = document.materials[document.meshes[0].primitives[1].material]
    assert plain.pbrMetallicRoughness.metallicFactor == 0
    back, _, found = read_gltf(tmp_path / "a.glb")
    assert [m.name for m in back.materials] == ["Material"] and found == []
    (mesh,) = back.meshes
    assert mesh.material == ""
    assert [(s.material, s.faces.tolist()) for s in mesh.subsets] == [("Material", [0])]
    np.testing.assert_allclose(mesh.corners("displayColor"), colours.values, atol=1e-6)


def test_separate_images_are_packed(tmp_path: Path, validate_gltf: Callable) -> None:
    colour, rough, metal, hole = (
        png(tmp_path / f"{name}.png", 3, value)
        for name, value in (("c", 0.2), ("r", 0.4), ("m", 0.6), ("h", 0.8))
    )
    material = Material(
        "m",
        (1.0, 1.0, 1.0),
        metallic=1.0,
        roughness=1.0,
        alpha_mode="blend",
        base_color_texture=colour,
        opacity_texture=replace(hole, channel="g"),
        roughness_texture=replace(rough, channel="b"),
        metallic_texture=replace(metal, channel="g"),
        occlusion_texture=replace(hole, channel="g"),
    )
    found = write_gltf(Rig("r", (sheet("m"),), None, (material,)), tmp_path / "a.gltf")
    assert {f.code for f in found} == {"TEXTURE_CONVERTED"}
    assert validate_gltf(tmp_path / "a.gltf")["issues"]["numErrors"] == 0
    (back,) = read_gltf(tmp_path / "a.gltf")[0].materials

    def mean(texture: Texture | None) -> list[int]:
        assert texture is not None
        image = oiio.ImageInput.open(texture.path)
        pixels = image.read_image(format="uint8")
        image.close()
        return [int(v) for v in np.median(pixels, axis=(0, 1))]

    # OpenImageIO gives colours multiplied by alpha: 51 * 204 / 255.
    assert mean(back.base_color_texture)[1:] == [41, 41, 204]
    assert mean(back.roughness_texture) == [255, 102, 153]
    assert mean(back.occlusion_texture) == [204] * 3
    assert (tmp_path / "a.gltf").read_bytes() == again(tmp_path, material)


def again(folder: Path, material: Material) -> bytes:
    write_gltf(Rig("r", (sheet("m"),), None, (material,)), folder / "a.gltf")
    return (folder / "a.gltf").read_bytes()


def test_udim_tiles_become_materials(tmp_path: Path, validate_gltf: Callable) -> None:
    for tile in (1001, 1002):
        png(tmp_path / f"skin.{tile}.png", value=tile / 2000)
    texture = Texture(str(tmp_path / "skin.<UDIM>.png"), suffix=".png", space="sRGB")
    rough = replace(texture, path=str(tmp_path / "rough.<UDIM>.png"), channel="g")
    png(tmp_path / "rough.1001.png")
    rig = Rig(
        "r",
        (sheet("m"),),
        None,
        (Material("m", (1.0, 1.0, 1.0), base_color_texture=texture, roughness_texture=rough),),
    )
    usd = through_usd(rig, tmp_path)
    assert usd.materials[0].base_color_texture == texture
    found = write_gltf(usd, tmp_path / "a.glb")
    assert {"TEXTURE_TILED", "TEXTURE_MISSING"} == {f.code for f in found} - {"TEXTURE_CONVERTED"}
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
    back = read_gltf(tmp_path / "a.glb")[0]
    assert [m.name for m in back.materials] == ["m_1001", "m_1002"]
    (mesh,) = back.meshes
    faces = {s.material: s.faces.tolist() for s in mesh.subsets}
    assert faces == {"m_1001": [0, 1], "m_1002": [2, 3]}
    first, second = (m.base_color_texture for m in back.materials)
    assert first is not None and second is not None
    assert first.data == (tmp_path / "skin.1001.png").read_bytes()
    assert second.data == (tmp_path / "skin.1002.png").read_bytes()
    assert [m.roughness_texture is None for m in back.materials] == [False, True]


def test_a_tile_takes_no_other_materials_name(tmp_path: Path) -> None:
    for tile in (1001, 1002):
        png(tmp_path / f"skin.{tile}.png")
    texture = Texture(str(tmp_path / "skin.<UDIM>.png"), suffix=".png")
    skin, other = Material("m", base_color_texture=texture), Material("m_1001", (1.0, 0.0, 0.0))
    rig = Rig("r", (sheet("m"), sheet("m_1001")), None, (skin, other))
    tiled, _ = untiled(rig)
    assert [m.name for m in tiled.materials] == ["m_1001", "m_1001_1", "m_1002"]
    assert [s.material for s in tiled.meshes[0].subsets] == ["m_1001_1", "m_1002"]
    assert tiled.meshes[1].material == "m_1001"


def test_udims_elsewhere_are_copied_tile_by_tile(tmp_path: Path, assert_valid_usd) -> None:
    (tmp_path / "far").mkdir()
    for tile in (1001, 1011):
        png(tmp_path / "far" / f"skin.{tile}.png", value=0.5)
    texture = Texture(str(tmp_path / "far" / "skin.<UDIM>.png"), suffix=".png")
    rig = Rig("r", (sheet("m"),), None, (Material("m", base_color_texture=texture),))
    write_rig(rig, tmp_path / "near" / "a.usda")
    names = sorted(p.name for p in (tmp_path / "near" / "a_textures").iterdir())
    assert names == ["m_baseColor.1001.png", "m_baseColor.1011.png"]
    assert read_rig(tmp_path / "near" / "a.usda")[1] == []
