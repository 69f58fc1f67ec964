from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdShade

from usdface.io.usd.preview_surface import Surface

TYPES = Sdf.ValueTypeNames


@pytest.fixture
def stage(tmp_path: Path) -> Usd.Stage:
    (tmp_path / "skin.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    stage = Usd.Stage.CreateNew(str(tmp_path / "face.usda"))
    shader = UsdShade.Shader.Define(stage, "/Skin/Surface")
    shader.SetShaderId("UsdPreviewSurface")
    shader.CreateInput("roughness", TYPES.Float).Set(0.25)
    image = UsdShade.Shader.Define(stage, "/Skin/Image")
    image.SetShaderId("UsdUVTexture")
    image.CreateInput("file", TYPES.Asset).Set("./skin.png")
    image.CreateInput("scale", TYPES.Float4).Set(Gf.Vec4f(0.5, 0.25, 0.75, 1))
    for name, kind, channel in (
        ("diffuseColor", TYPES.Color3f, "rgb"),
        ("metallic", TYPES.Float, "b"),
        ("occlusion", TYPES.Float, "r"),
    ):
        given = shader.CreateInput(name, kind)
        given.ConnectToSource(image.CreateOutput(channel, kind))
    stage.Save()
    return stage


def surface(stage: Usd.Stage) -> Surface:
    return Surface(UsdShade.Shader.Get(stage, "/Skin/Surface"), "/Skin")


def test_values_and_what_multiplies_textures(stage: Usd.Stage) -> None:
    read = surface(stage)
    assert read.number("roughness", 0.5) == 0.25 and read.number("clearcoat", 0.125) == 0.125
    assert read.colour("diffuseColor", (0, 0, 0)) == (0.5, 0.25, 0.75)
    assert read.colour("emissiveColor", (0, 0, 1)) == (0, 0, 1)
    assert read.number("metallic", 0.0) == 0.75 and read.texture("roughness") is None
    colour, metallic = read.texture("diffuseColor"), read.texture("metallic")
    assert colour is not None and metallic is not None
    assert (colour.channel, metallic.channel) == ("", "b") and colour.path == metallic.path
    assert read.findings == []


def test_a_bias_is_told_but_for_that_of_occlusion(stage: Usd.Stage) -> None:
    image = UsdShade.Shader.Get(stage, "/Skin/Image")
    image.CreateInput("bias", TYPES.Float4).Set(Gf.Vec4f(0.1, 0, 0, 0))
    read = surface(stage)
    read.number("occlusion", 1.0)
    assert read.findings == []
    read.number("metallic", 0.0)
    assert [f.code for f in read.findings] == ["FEATURE_DROPPED"]


def test_another_node_is_told_and_drives_nothing(stage: Usd.Stage) -> None:
    noise = UsdShade.Shader.Define(stage, "/Skin/Noise")
    noise.SetShaderId("MyNoise")
    shader = UsdShade.Shader.Get(stage, "/Skin/Surface")
    shader.GetInput("roughness").ConnectToSource(noise.CreateOutput("out", TYPES.Float))
    read = surface(stage)
    assert read.number("roughness", 0.5) == 0.5
    assert [f.message for f in read.findings] == [
        "roughness comes from a shader node that is not kept"
    ]


def test_a_texture_that_changes_over_time_is_told(stage: Usd.Stage, tmp_path: Path) -> None:
    """As the frames of a film on a screen, or a texture that scrolls."""
    image = UsdShade.Shader.Get(stage, "/Skin/Image")
    move = UsdShade.Shader.Define(stage, "/Skin/Move")
    move.SetShaderId("UsdTransform2d")
    image.CreateInput("st", TYPES.Float2).ConnectToSource(move.CreateOutput("result", TYPES.Float2))
    offset = move.CreateInput("translation", TYPES.Float2)
    offset.Set(Gf.Vec2f(0.5, 0))
    read = surface(stage)
    assert read.texture("metallic") is not None and read.findings == []
    (tmp_path / "other.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    for code, name, place in ((1.0, "./skin.png", 0.0), (2.0, "./other.png", 1.0)):
        image.GetInput("file").Set(name, code)
        offset.Set(Gf.Vec2f(place, 0), code)
    stage.Save()
    read = surface(stage)
    assert read.texture("metallic") is not None
    assert [(f.code, f.values["channels"]) for f in read.findings] == [
        ("ANIMATION_DROPPED", ["file", "translation"])
    ]


def test_texture_coordinates_that_drive_themselves_end(stage: Usd.Stage) -> None:
    """Two transforms that each take the other's result, in a broken file."""
    image = UsdShade.Shader.Get(stage, "/Skin/Image")
    moves = [UsdShade.Shader.Define(stage, f"/Skin/Move{n}") for n in (1, 2)]
    for move in moves:
        move.SetShaderId("UsdTransform2d")
    for part, name, other in (
        (image, "st", moves[0]),
        (moves[0], "in", moves[1]),
        (moves[1], "in", moves[0]),
    ):
        given = part.CreateInput(name, TYPES.Float2)
        given.ConnectToSource(other.CreateOutput("result", TYPES.Float2))
    stage.Save()
    assert surface(stage).texture("metallic") is not None


def test_a_value_that_is_repeated_for_each_frame_does_not_change(stage: Usd.Stage) -> None:
    image = UsdShade.Shader.Get(stage, "/Skin/Image")
    roughness = UsdShade.Shader.Get(stage, "/Skin/Surface").GetInput("roughness")
    for code in (1.0, 2.0):
        image.GetInput("file").Set("./skin.png", code)
        roughness.Set(0.25, code)
    stage.Save()
    read = surface(stage)
    assert read.texture("metallic") is not None and read.number("roughness", 0.0) == 0.25
    assert read.findings == []
