import json
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

from usdface.clips import Clip
from usdface.io.gltf.frame_rate import chosen_rate, frame_rate
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig_write import write_rig
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import Rig
from usdface.takes import WeightsTake

# A phone of 30 frames a second, three dropped: its clock is off by half a frame in two minutes.
PHONE = np.delete(np.arange(4033), (5, 700, 3000)) / 30.004


@pytest.mark.parametrize(
    ("keys", "rate"),
    [
        (np.arange(9) / 60, 60.0),
        (np.float32(np.arange(99) / 29.97).astype(float), 29.97),
        (np.float32(500 + np.arange(10) / 30).astype(float), 30.0),  # 30.001 by rounding
        (np.float32(3 + np.array([0, 1, 3]) / 120).astype(float), 120.0),
        (PHONE, 30.004),
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


@pytest.mark.parametrize(
    ("shown", "stated", "chosen"),
    [
        (30.004, 30.0, 30.0),
        (29.97, 30.0, 29.97),  # both are rates
        (24.0, 1.0, 24.0),  # keys a second apart
        (29.97, 30000 / 1001, 30000 / 1001),
        (0.0, 30.0, 30.0),
        (0.0, 13.7, 0.0),
        (30.004, 0.0, 30.004),
        (0.0, 0.0, 0.0),
    ],
)
def test_a_stated_rate_counts_where_the_keys_are_of_it(
    shown: float, stated: float, chosen: float
) -> None:
    assert chosen_rate(shown, stated) == chosen


def test_the_rate_of_a_phone_survives_glb(face_rig: Rig, tmp_path: Path) -> None:
    """The stage's 30, though its keys, which drift and keep their times, show 30.004."""
    names = face_rig.shape_names
    weights = np.random.default_rng(1).random((len(PHONE), len(names)))
    jitter = np.random.default_rng(2).uniform(-2e-5, 2e-5, len(PHONE))
    take = WeightsTake(names, PHONE - PHONE[0] + abs(jitter[0]) + jitter, weights, 30.0)
    write_rig(face_rig, tmp_path / "a.usdc", [Clip("a", take)])
    export_scene(tmp_path / "a.usdc", tmp_path / "a.glb")
    done = import_scene(tmp_path / "a.glb", tmp_path / "b.usdc")
    assert done.summary["rate_hz"] == 30
    one, other = (Usd.Stage.Open(str(tmp_path / name)) for name in ("a.usdc", "b.usdc"))
    assert other.GetTimeCodesPerSecond() == 30
    assert other.GetEndTimeCode() == pytest.approx(one.GetEndTimeCode(), abs=1e-3)


@pytest.mark.parametrize(
    "given",
    [30, "30", None, True, -30, 10**400, [30]],
    ids=["good", "text", "none", "true", "below", "large", "list"],
)
def test_a_kept_rate_that_is_none_does_not_count(
    given: object, face_rig: Rig, tmp_path: Path
) -> None:
    names = face_rig.shape_names
    take = WeightsTake(names, PHONE, np.random.default_rng(1).random((len(PHONE), len(names))), 30)
    path = tmp_path / "a.gltf"
    write_gltf(face_rig, path, [Clip("a", take)])
    document = json.loads(path.read_text())
    ours = document["animations"][0]["extras"]["usdface"]
    assert ours["framesPerSecond"] == 30
    ours["framesPerSecond"] = given
    path.write_text(json.dumps(document))
    (clip,) = read_gltf(path)[1]
    assert clip.rate == (30 if given == 30 and given is not True else 30.004)


def test_a_rate_that_the_keys_show_is_not_kept(face_rig: Rig, tmp_path: Path) -> None:
    names = face_rig.shape_names
    take = WeightsTake(names, np.arange(9) / 60, np.eye(9, len(names)), 60.0)
    write_gltf(face_rig, tmp_path / "a.gltf", [Clip("a", take)])
    assert "framesPerSecond" not in (tmp_path / "a.gltf").read_text()
