"""Node animation of any glTF as what UsdSkel shows, by two evaluators that know nothing of us."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.io.compare_conversion import certify_conversion
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
CORNERS = np.array([0, 1, 2, 0, 3, 1], "<u2")
WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
HELD = np.array([0.5, 1, 2, 4])  # scales that 16 bits hold


class Forest:
    """Random nodes, some with a mesh, and animations of their transforms."""

    def __init__(self, seed: int, modes: list[str]) -> None:
        self.rng = np.random.default_rng(seed)
        self.arrays = [POINTS, CORNERS]
        self.nodes = [self.node(k) for k in range(7)]
        for k in range(1, 7):
            above = self.nodes[self.rng.integers(0, k)] if k > 1 else self.nodes[0]
            above.setdefault("children", []).append(k)
        self.animations = [self.animation(f"Lauf ü {k}", modes) for k in range(2)]

    def node(self, number: int) -> dict[str, Any]:
        rng = self.rng
        turn = rng.normal(size=4)
        node: dict[str, Any] = {
            "name": f"Knoten.{number}",
            "translation": rng.normal(size=3).tolist(),
            "rotation": (turn / np.linalg.norm(turn)).tolist(),
            "scale": [float(rng.choice(HELD))] * 3,
        }
        return node | ({"mesh": 0} if number in (0, 3, 6) else {})

    def array(self, values: np.ndarray) -> int:
        self.arrays.append(values.reshape(-1, values.shape[-1]).astype("<f4"))
        return len(self.arrays) - 1

    def animation(self, name: str, modes: list[str]) -> dict[str, Any]:
        channels, samplers = [], []
        for node in self.rng.permutation(7)[:3].tolist():
            for path, width in WIDTHS.items():
                keys = int(self.rng.integers(2, 6))
                mode = str(self.rng.choice(modes)) if path != "scale" else "STEP"
                shape = (keys, 3, width) if mode == "CUBICSPLINE" else (keys, width)
                values = self.rng.normal(size=shape)
                if path == "scale":
                    values = self.rng.choice(HELD, (*shape[:-1], 1)) * np.ones(3)
                if path == "rotation":
                    values /= np.linalg.norm(values, axis=-1, keepdims=True)
                    if mode == "CUBICSPLINE":  # no tangents, so that it never comes near zero
                        values[1:, 1] = values[:1, 1] + 0.2 * values[1:, 1]
                        values[:, [0, 2]] = 0
                times = np.sort(self.rng.choice(40, keys, replace=False)) / 8
                sampler = {"input": self.array(times[:, None]), "interpolation": mode}
                samplers.append(sampler | {"output": self.array(values)})
                target = {"node": node, "path": path}
                channels.append({"sampler": len(samplers) - 1, "target": target})
        return {"name": name, "channels": channels, "samplers": samplers}

    def document(self) -> dict[str, Any]:
        primitive = {"attributes": {"POSITION": 0}, "indices": 1}
        return {
            "meshes": [{"primitives": [primitive]}],
            "nodes": self.nodes,
            "scenes": [{"nodes": [0]}],
            "animations": self.animations,
        }


def off_by(path: Path, folder: Path) -> float:
    """Largest distance of a vertex between glTF and USD, in parts of the size of all."""
    rig, clips, _ = read_gltf(path)
    write_rig(rig, folder / "b.usdc", clips)
    stage = open_stage(folder / "b.usdc")
    certificate, _ = certify_conversion(stage, path, exported=False, every_frame=True)
    assert certificate is not None
    assert [*certificate.clips] == ["Lauf ü 0", "Lauf ü 1"]
    assert certificate.time_drift < 1e-6
    assert certificate.missing == ()
    return certificate.vertex_largest / certificate.diagonal


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_lines_and_steps_are_exact(tmp_path: Path, write_glb, seed: int) -> None:
    forest = Forest(seed, ["LINEAR", "STEP"])
    path = write_glb(tmp_path / "a.glb", forest.document(), forest.arrays)
    assert off_by(path, tmp_path) < 1e-5
    back = export_scene(tmp_path / "b.usdc", tmp_path / "c.glb", every_frame=True)
    assert [f for f in back.findings if f.severity != "info"] == []
    names = {clip.name: clip.joints for clip in read_gltf(tmp_path / "c.glb")[1]}
    for clip in read_gltf(path)[1]:
        assert clip.joints is not None and names[clip.name] is not None
        np.testing.assert_allclose(names[clip.name].times, clip.joints.times, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5, 8))
def test_curves_are_within_the_limit_of_the_certificate(
    tmp_path: Path, write_glb, seed: int
) -> None:
    forest = Forest(seed, ["CUBICSPLINE"])
    path = write_glb(tmp_path / "a.glb", forest.document(), forest.arrays)
    assert "CURVE_RESAMPLED" in {f.code for f in read_gltf(path)[2]}
    assert off_by(path, tmp_path) < 1e-5


def test_scales_that_grow_are_as_near_as_16_bits_come(tmp_path: Path, write_glb) -> None:
    forest = Forest(8, ["LINEAR"])
    for animation in forest.animations:
        for sampler in animation["samplers"]:
            sampler["interpolation"] = "LINEAR"
    path = write_glb(tmp_path / "a.glb", forest.document(), forest.arrays)
    rig, clips, _ = read_gltf(path)
    found = write_rig(rig, tmp_path / "a.usdc", clips)
    assert "SCALE_ROUNDED" in {f.code for f in found}
    assert 1e-6 < off_by(path, tmp_path) < 1e-3
