"""Blender and three.js play inbetweens, which are targets of their own, and several clips."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd, UsdSkel, Vt

from usdface.clips import Clip
from usdface.io.usd.rig_write import write_rig
from usdface.pipeline import export_scene
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig
from usdface.takes import WeightsTake

pytestmark = pytest.mark.slow

NAMES = ("jaw", "smile")
KEYS = np.arange(31) / 30
TURNS = {"talk": (0.7, 2.0), "laugh": (3.0, 1.1)}
FRAMES = [0, 6, 14, 30, 44, 58]


def curves(clip: str) -> np.ndarray:
    return np.abs(np.sin(KEYS[:, None] * TURNS[clip]))


@pytest.fixture(scope="module")
def face(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sheet with two shapes, one with two inbetweens, and two clips: a.usda and a.glb."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    steps = tuple(
        Inbetween(name, place, [[0, 0, place**2]]) for name, place in (("ajar", 0.3), ("half", 0.6))
    )
    shapes = (
        BlendShape("jaw", [0], [[0, 0, 1]], inbetweens=steps),
        BlendShape("smile", [2], [[0, 1, 0]]),
    )
    mesh = Mesh("Face", points, [3, 3], [0, 1, 2, 0, 2, 3], shapes=shapes)
    clips = [Clip(name, WeightsTake(NAMES, KEYS, curves(name), 30.0)) for name in TURNS]
    folder = tmp_path_factory.mktemp("clips")
    write_rig(Rig("r", (mesh,)), folder / "a.usda", clips)
    export_scene(folder / "a.usda", folder / "a.glb")
    return folder


def truth(face: Path, clip: str) -> list[dict[str, float]]:
    """What UsdSkel weighs each shape and inbetween with at the frames (60 a second)."""
    stage = Usd.Stage.Open(str(face / "a.usda"))
    (prim,) = (p for p in stage.Traverse() if UsdSkel.BindingAPI(p).GetBlendShapesAttr().Get())
    query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
    labels = []
    for number in range(query.GetNumSubShapes()):
        between = query.GetInbetween(number)
        shape = NAMES[query.GetBlendShapeIndex(number)]
        labels.append(f"{shape}:{between.GetAttr().GetBaseName()}" if between else shape)
    played = []
    for frame in FRAMES:
        weights = [np.interp(frame / 60, KEYS, column) for column in curves(clip).T]
        values, _, places = query.ComputeSubShapeWeights(Vt.FloatArray(weights))
        played.append(dict.fromkeys(labels, 0.0))
        for value, place in zip(values, places, strict=True):
            played[-1][labels[place]] += value
    return played


def same(played: list[dict[str, dict[str, float]]], expected: list[dict[str, float]]) -> None:
    """Compare all targets at all frames."""
    for (shown,), wanted in zip((f.values() for f in played), expected, strict=True):
        assert shown == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("clip", list(TURNS))
def test_blender_plays_inbetweens_and_clips(
    face: Path, blender: Callable[..., dict[str, Any]], clip: str
) -> None:
    same(blender(face / "a.glb", FRAMES, clip)["frames"], truth(face, clip))


@pytest.mark.parametrize("clip", list(TURNS))
def test_three_plays_inbetweens_and_clips(
    face: Path, three: Callable[..., dict[str, Any]], clip: str
) -> None:
    times = [frame / 60 for frame in FRAMES]
    same(three(face / "a.glb", times, 0.0, clip)["frames"], truth(face, clip))
