"""Scenes that name files of the user: none of them gets into what is passed on."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from spoilt import Place

from usdface.cli import main
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.usdz_package import write_package
from usdface.materials import Material, Texture
from usdface.rigs import BlendShape, Mesh, Rig

SECRET = b"\x89PNG\r\n\x1a\n a secret of the user"
PUBLIC = b"\x89PNG\r\n\x1a\n a texture of the scene"
_TEXTURE = "./scene_textures/Skin_baseColor.png"


@pytest.fixture
def rig() -> Rig:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    shape = BlendShape("jawOpen", np.array([2]), np.array([[0, 0, 0.5]]))
    faces = np.array([3]), np.array([0, 1, 2])
    mesh = Mesh("Head", points, *faces, shapes=(shape,), material="Skin")
    skin = Material("Skin", base_color_texture=Texture(data=PUBLIC, suffix=".png"))
    return Rig("Head", (mesh,), None, (skin,))


@pytest.fixture
def folder(rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a scene; secrets lie above it and in the working directory."""
    for name in ("secret.png", "secret.1001.png", "cwd/near.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(SECRET)
    folder = tmp_path / "asset"
    write_rig(rig, folder / "scene.usda")
    monkeypatch.chdir(tmp_path / "cwd")
    return folder


def naming(texture: str) -> Callable[[Path], Path]:
    def scene(folder: Path) -> Path:
        path = folder / "scene.usda"
        text = path.read_text()
        assert f"@{_TEXTURE}@" in text
        path.write_text(text.replace(_TEXTURE, texture.replace("{top}", str(folder.parent))))
        return path

    return scene


def linked(name: str, target: str) -> Callable[[Path], Path]:
    def scene(folder: Path) -> Path:
        (folder / name.split("/")[0].replace("<UDIM>", "1001")).symlink_to(folder / target)
        return naming(f"./{name}")(folder)

    return scene


def piped(folder: Path) -> Path:
    os.mkfifo(folder / "pipe.png")
    return naming("./pipe.png")(folder)


def nested(folder: Path) -> Path:
    """A sublayer of a sublayer, in a folder of its own, leads up and out."""
    inner = naming("../../../secret.png")(folder)
    (folder / "a" / "b").mkdir(parents=True)
    inner.rename(folder / "a" / "b" / "inner.usda")
    for name, below in (("a/middle.usda", "./b/inner.usda"), ("root.usda", "./a/middle.usda")):
        layer = Sdf.Layer.CreateNew(str(folder / name))
        layer.subLayerPaths = [below]
        layer.defaultPrim = "Asset"
        layer.Save()
    return folder / "root.usda"


def other_layers_folder(folder: Path) -> Path:
    """A weaker opinion of a layer in another folder opens that folder to none but itself."""
    path = naming("{top}/secret.png")(folder)
    (folder.parent / "lib.usda").write_text(path.read_text().replace("secret", "public"))
    path.write_text(path.read_text().replace("(\n", "(\n    subLayers = [@../lib.usda@]\n", 1))
    return path


def packaged(folder: Path) -> Path:
    """A package holds what it names; it may not look around where it lies."""
    (folder / "private.png").write_bytes(SECRET)
    text = naming(f"{folder}/private.png")(folder).read_text()
    write_package(folder / "scene.usdz", {"scene.usda": text.encode()})
    return folder / "scene.usdz"


ATTACKS: dict[str, Callable[[Path], Path]] = {
    "absolute": naming("{top}/secret.png"),
    "above": naming("../secret.png"),
    "up and down": naming("./scene_textures/../../secret.png"),
    "encoded": naming("%2E%2E/secret.png"),
    "URL": naming("file://{top}/secret.png"),
    "working directory": naming("near.png"),
    "a link": linked("link.png", "../secret.png"),
    "a linked folder": linked("link/secret.png", ".."),
    "UDIM above": naming("../secret.<UDIM>.png"),
    "a tile that is a link": linked("skin.<UDIM>.png", "../secret.png"),
    "nested": nested,
    "another layer's folder": other_layers_folder,
    "a package": packaged,
    "inside another package": naming("{top}/none.usdz[secret.png]"),
    "FIFO": piped,
    "device": naming("/dev/zero"),
    "a link to a device": linked("zero.png", "/dev/zero"),
}
REACHED = ("absolute", "above", "up and down", "a link", "a linked folder", "UDIM above", "nested")
WAYS = ("usdz", "glb", "usda")


def run(scene: Path, out: Path, *more: object) -> tuple[bytes, list[str]]:
    """Convert a scene; return all bytes that were written, and the codes of findings."""
    command = "rig" if out.suffix == ".usda" else "export"
    report = out.with_suffix(".json")
    arguments = [command, scene, "-o", out, "--report", report, *more]
    assert main([str(a) for a in arguments]) == 0
    codes = [finding["code"] for finding in json.loads(report.read_text())["findings"]]
    report.unlink()
    files = [p for p in out.parent.rglob("*") if p.is_file()]
    assert not any(p.is_symlink() for p in out.parent.rglob("*"))
    return b"".join(p.read_bytes() for p in files), codes


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("attack", ATTACKS)
def test_no_secret_gets_out(
    folder: Path, capfd: pytest.CaptureFixture[str], attack: str, way: str
) -> None:
    scene = ATTACKS[attack](folder)
    written, codes = run(scene, folder.parent / "out" / f"o.{way}")
    assert SECRET not in written and str(folder.parent).encode() + b"/secret" not in written
    assert {"ASSET_OUTSIDE", "TEXTURE_MISSING"} & set(codes)
    assert capfd.readouterr().err == ""
    if attack in REACHED:
        assert "ASSET_OUTSIDE" in codes
        written, codes = run(
            scene, folder.parent / "out" / f"o.{way}", "--asset-root", folder.parent
        )
        assert SECRET in written and "ASSET_OUTSIDE" not in codes


@pytest.mark.parametrize("way", [*WAYS, "gltf"])
def test_what_lies_in_the_folder_goes_along(folder: Path, way: str) -> None:
    written, codes = run(folder / "scene.usda", folder.parent / "out" / f"o.{way}")
    assert PUBLIC in written and not {"ASSET_OUTSIDE", "TEXTURE_MISSING"} & set(codes)


@pytest.mark.parametrize("way", WAYS)
def test_a_published_link_has_the_textures_of_its_target(folder: Path, way: str) -> None:
    """Studios link a version of an asset, with its folders, to where it is referenced from."""
    shown = folder.parent / "published"
    shown.mkdir()
    for name in ("scene.usda", "scene_textures"):
        (shown / name).symlink_to(folder / name)
    assert PUBLIC in run(shown / "scene.usda", folder.parent / "out" / f"o.{way}")[0]


def test_metadata_name_no_files_of_the_user(folder: Path) -> None:
    path = folder / "scene.usda"
    layer = Sdf.Layer.FindOrOpen(str(path))
    layer.customLayerData = {"a": Sdf.AssetPath("../secret.png")}
    prim = layer.GetPrimAtPath("/Asset")
    prim.SetInfo("customData", {"b": Sdf.AssetPath(str(folder.parent / "secret.png"))})
    prim.SetInfo("assetInfo", {"identifier": Sdf.AssetPath("./scene.usda")})
    attribute = Sdf.AttributeSpec(prim, "several", Sdf.ValueTypeNames.AssetArray)
    layer.SetTimeSample(attribute.path, 1.0, Sdf.AssetPathArray(["../secret.png", "./gone.png"]))
    layer.Save()
    written, codes = run(path, folder.parent / "out" / "o.usdz")
    assert SECRET not in written and PUBLIC in written
    assert codes.count("ASSET_OUTSIDE") == 1 and codes.count("TEXTURE_MISSING") == 1
    stage = Usd.Stage.Open(str(folder.parent / "out" / "o.usdz"))
    assert str(folder.parent) not in stage.GetRootLayer().ExportToString()


@pytest.mark.parametrize("uri", ["../secret.png", "%2E%2E/secret.png", "link.png"])
def test_a_gltf_brings_no_secret_in(rig: Rig, folder: Path, uri: str) -> None:
    scene = folder / "face.gltf"
    write_gltf(rig, scene)
    (folder / "link.png").symlink_to("../secret.png")
    document = json.loads(scene.read_text())
    document["images"][0]["uri"] = uri
    scene.write_text(json.dumps(document))
    out = folder.parent / "out"
    for command in ("import", "rig"):
        arguments = [command, str(scene), "-o", str(out / f"{command}.usda")]
        for more, known in (([], False), (["--asset-root", str(folder.parent)], True)):
            assert main([*arguments, *more]) == 0
            files = [p.read_bytes() for p in out.rglob("*") if p.is_file()]
            assert any(SECRET in data for data in files) == known
        (out / f"{command}_textures" / "Skin_baseColor.png").unlink()


def test_buffers_of_a_gltf_come_from_a_wider_folder_only_if_told(
    rig: Rig, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = folder / "face.gltf"
    write_gltf(rig, scene)
    (folder / "face.bin").rename(folder.parent / "face.bin")
    scene.write_text(scene.read_text().replace('"face.bin"', '"../face.bin"'))
    arguments = ["import", str(scene), "-o", str(folder / "o.usda")]
    assert main(arguments) == 1 and "[URI_OUTSIDE]" in capsys.readouterr().err
    assert main([*arguments, "--asset-root", str(folder.parent), "--strict"]) == 0
    assert "vertex error max [mm]" in capsys.readouterr().out
    assert main([*arguments, "--asset-root", str(folder / "none")]) == 1
    assert "is no folder" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("way", ["../secret.png", "link.png"])
def test_process_brings_no_secret_in(place: Place, tmp_path: Path, way: str) -> None:
    top = place / "asset"
    top.mkdir()
    for path in [p for p in place.folder.iterdir() if p.is_file()]:
        path.rename(top / path.name)
    (place / "secret.png").write_bytes(SECRET)
    (top / "link.png").symlink_to(place / "secret.png")
    character = read_rig(top / "rig.usda")[0]
    skin = Material("Skin", base_color_texture=Texture(data=PUBLIC, suffix=".png"))
    meshes = tuple(replace(mesh, material="Skin", subsets=()) for mesh in character.meshes)
    write_rig(replace(character, meshes=meshes, materials=(skin,)), top / "rig.usda")
    text = (top / "rig.usda").read_text()
    (top / "rig.usda").write_text(text.replace("rig_textures/Skin_baseColor.png", way))
    command = ["process", str(top / "shot.usda"), "--gltf", str(place / "o.glb")]
    assert main(command) == 0 and SECRET not in (place / "o.glb").read_bytes()
    assert main([*command, "--asset-root", str(place.folder)]) == 0
    assert SECRET in (place / "o.glb").read_bytes()
