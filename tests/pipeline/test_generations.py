"""A reader that comes between any two moves of a result finds all of the old or all of the new."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote

import pytest
from pxr import Usd, UsdSkel
from worlds import make_world

import usdface
from usdface.io.gltf.write import write_gltf
from usdface.io.staging import Step
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Texture
from usdface.options import ProcessOptions
from usdface.rigs import Rig


@pytest.fixture
def between_moves(
    monkeypatch: pytest.MonkeyPatch,
) -> Callable[[Callable[[], object]], list[object]]:
    """A function that collects what a reader finds before and after each move from now on."""
    run = Step.run

    def collect(read: Callable[[], object]) -> list[object]:
        found = [read()]

        def moved(step: Step) -> None:
            run(step)
            found.append(read())

        monkeypatch.setattr(Step, "run", moved)
        return found

    return collect


def one_switch(found: list[object]) -> bool:
    """Whether readers found the old for a time, then the new."""
    new = next(k for k, value in enumerate(found) if value != found[0])
    return len(found) > 2 and found[:new] + (len(found) - new) * [found[-1]] == found


@pytest.mark.slow
def test_layers_of_process(tmp_path: Path, between_moves: Callable[..., list[object]]) -> None:
    world = make_world().write(tmp_path)
    shot, root = tmp_path / "shot.usda", tmp_path / "shot.usdface.usda"
    usdface.make_shot(world / "rig.usda", world / "take.usda", shot, bind=world / "bind.json")
    usdface.process(shot)

    def read() -> object:
        stage = Usd.Stage.Open(str(root))
        stage.Reload()
        assert not stage.GetCompositionErrors()
        layers = [layer for layer in stage.GetLayerStack() if layer.realPath.endswith(".usdc")]
        animation = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
        path = animation.GetPath().AppendProperty("blendShapeWeights")
        samples = [
            layer.QueryTimeSample(path, layer.ListTimeSamplesForPath(path)[-9]) for layer in layers
        ]
        return [list(sample) for sample in samples]

    found = between_moves(read)
    usdface.process(shot, options=ProcessOptions(closure=False, exaggeration={"face": 1.5}))
    assert one_switch(found)
    assert not (tmp_path / "shot.usdface/closure.usdc").exists()


def textured(content: bytes, size: float) -> Rig:
    (mesh,) = make_world().rig.meshes
    png = b"\x89PNG\r\n\x1a\n" + content
    skin = Material("Skin", base_color_texture=Texture(data=png, suffix=".png"))
    mesh = replace(mesh, points=size * mesh.points, material="Skin", shapes=())
    return Rig("face", (mesh,), materials=(skin,))


def test_textures_of_a_rig(tmp_path: Path, between_moves: Callable[..., list[object]]) -> None:
    path = tmp_path / "rig.usda"
    write_rig(textured(b"old", 1), path)

    def read() -> object:
        stage = Usd.Stage.Open(str(path))
        stage.Reload()
        named = [a for p in stage.Traverse() for a in p.GetAttributes()]
        (asset,) = (a.Get().resolvedPath for a in named if a.GetName() == "inputs:file")
        (points,) = (a.Get() for a in named if a.GetName() == "points")
        return points[0][0], Path(asset).read_bytes()

    found = between_moves(read)
    write_rig(textured(b"new", 2), path)
    assert one_switch(found)


def test_buffers_of_a_gltf(tmp_path: Path, between_moves: Callable[..., list[object]]) -> None:
    path = tmp_path / "a face.gltf"
    write_gltf(textured(b"old", 1), path)

    def read() -> object:
        document = json.loads(path.read_text())
        named = [*document["buffers"], *document.get("images", ())]
        return document["accessors"], *[(tmp_path / unquote(p["uri"])).read_bytes() for p in named]

    found = between_moves(read)
    write_gltf(textured(b"new", 2), path)
    assert one_switch(found)
