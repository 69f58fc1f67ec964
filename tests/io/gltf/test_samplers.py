import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.gltf import animation_size
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.samplers import Curve

POINTS = np.eye(3, dtype="<f4")


def test_ends_hold_and_quaternions_turn_the_short_way() -> None:
    half = np.sqrt(0.5)
    keys = np.array([1.0, 3.0])
    turning = Curve(keys, np.array([[0, 0, 0, 1], [0, 0, -half, -half]]), keys, True)
    values = turning.at(np.array([0.0, 2.0, 9.0]))
    eighth = [0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)]
    np.testing.assert_allclose(values[:2], [[0, 0, 0, 1], eighth], atol=1e-12)
    np.testing.assert_allclose(np.abs(values[2]), [0, 0, half, half], atol=1e-12)


@pytest.mark.parametrize("what", ["keys", "cubic", "union", "weights"])
def test_small_files_do_not_unfold_into_huge_curves(write_glb, tmp_path, monkeypatch, what) -> None:
    monkeypatch.setattr(animation_size, "_MOST_NUMBERS", 1000)
    path = "weights" if what == "weights" else "translation"
    keys = {"keys": 600, "cubic": 10, "union": 60, "weights": 60}[what]
    mode = "CUBICSPLINE" if what == "cubic" else "LINEAR"
    width = 1 if path == "weights" else 3
    arrays, samplers, channels, nodes = [POINTS, POINTS], [], [], []
    targets = [{"POSITION": 1}] * (1 if path == "weights" else 0)
    for node in range(5):
        times = (np.arange(keys) + node / 8).astype("<f4")
        values = 1e6 * np.arange(keys * width * (3 if what == "cubic" else 1)).reshape(-1, width)
        arrays += [times, values.astype("<f4")]
        channels.append({"sampler": node, "target": {"node": node, "path": path}})
        end = len(arrays)
        samplers.append({"input": end - 2, "output": end - 1, "interpolation": mode})
        nodes.append({"mesh": 0, "name": f"n{node}"})
    primitive = {"attributes": {"POSITION": 0}, "targets": targets}
    document = {
        "meshes": [{"primitives": [primitive]}],
        "nodes": nodes,
        "scenes": [{"nodes": list(range(5))}],
        "animations": [{"name": "wild", "samplers": samplers, "channels": channels}],
    }
    with pytest.raises(InputError, match="unfolds into more than 1000"):
        read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
