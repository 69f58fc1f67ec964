from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

from usdface.io.gltf.frame_rate import frame_rate
from usdface.pipeline import import_scene


@pytest.mark.parametrize(
    ("keys", "rate"),
    [
        (np.arange(9) / 60, 60.0),
        (np.float32(np.arange(99) / 29.97).astype(float), 29.97),
        (np.array([0, 0.4, 1.1, 1.6]), 30.0),  # steps of 12, 21 and 15 frames
        (np.array([0, 2.0]), 24.0),  # not half a frame a second
        (np.array([0, 1 / 870, 2 / 870]), 0.0),
        (np.array([0, 0.1234, 1.0]), 0.0),
        (np.zeros(1), 0.0),
    ],
)
def test_rates_are_those_that_animation_is_made_at(keys, rate) -> None:
    assert frame_rate(keys) == rate


def test_resampled_keys_are_no_frames(write_glb, tmp_path: Path) -> None:
    """A cubic curve of four keys at 24 a second becomes hundreds of lines."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    times = (np.array([0, 1, 2, 5]) / 24).astype("<f4")
    cubic = np.array([[0, 0, 90], [90, 1, -90], [90, -1, 40], [0, 1, 0]], "<f4").reshape(-1, 1)
    sampler = {"input": 2, "output": 3, "interpolation": "CUBICSPLINE"}
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}]}],
        "animations": [
            {
                "samplers": [sampler],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
            }
        ],
    }
    path = write_glb(tmp_path / "a.glb", document, [points, points[::-1].copy(), times, cubic])
    done = import_scene(path, tmp_path / "a.usda", every_frame=True)
    assert Usd.Stage.Open(str(tmp_path / "a.usda")).GetTimeCodesPerSecond() == 24
    assert done.summary["frames"] > 50
