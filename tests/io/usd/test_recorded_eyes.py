"""Eyes that a phone recorded, through files: UsdSkel and a player of glTF are the judges."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import evaluate_gltf
from eye_rig import EYE_PLACES, with_eyes
from pxr import Usd
from scipy.spatial.transform import Rotation
from worlds import make_world, restaged

from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.face.gaze_curves import gaze_angles
from usdface.io.usd.evaluate import evaluate_usd
from usdface.io.usd.take_write import write_take
from usdface.takes import WeightsTake

FRAMES = 12
GAZE = (
    *("eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeLookDownLeft"),
    *("eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight", "eyeLookDownRight"),
)
TURNS = np.outer(np.linspace(0.0, 0.6, FRAMES), [0.3, 1.0, -0.2])


@pytest.fixture
def take() -> WeightsTake:
    world = make_world()
    names = (*world.rig.shape_names, *GAZE)
    weights = np.zeros((FRAMES, len(names)))
    weights[:, -len(GAZE) :] = np.random.default_rng(4).random((FRAMES, len(GAZE)))
    return WeightsTake(names, np.arange(FRAMES) / 30.0, weights, 30.0, head=TURNS)


def processed(folder: Path, take: WeightsTake, unit: tuple[float, str] = (1.0, "Y")) -> Path:
    world = make_world()
    replace(world, rig=with_eyes(world.rig)).write(folder)
    if unit != (1.0, "Y"):
        restaged(folder / "rig.usda", *unit)
    write_take(take, folder / "take.usda")
    names = {name: str(folder / f"{name}.usda") for name in ("rig", "take", "shot")}
    assert main(["shot", "--rig", names["rig"], "--take", names["take"], "-o", names["shot"]]) == 0
    gltf = str(folder / "shot.glb")
    assert main(["process", names["shot"], "--no-closure", "--gltf", gltf]) == 0
    return folder / "shot.usdface.usda"


def judged(path: Path, take: WeightsTake) -> list[list[FloatArray]]:
    """The points of face, left and right eye as USD and glTF show them [m]: (F, V, 3) each."""
    stage = Usd.Stage.Open(str(path))
    by_usd = [mesh.points_at(np.arange(float(FRAMES))) for mesh in evaluate_usd(stage)]
    by_gltf = [mesh.points_at(take.times) for mesh in evaluate_gltf(path.parent / "shot.glb")]
    return [by_usd, by_gltf]


def turned(take: WeightsTake, rest: FloatArray, eye: int) -> FloatArray:
    """Where the points of an eye are in its head: (F, V, 3)."""
    yaw, pitch = gaze_angles(take.names, take.weights)[("left", "right")[eye]].T
    turns = Rotation.from_euler("YX", np.stack([yaw, -pitch], axis=1)).as_matrix()
    return EYE_PLACES[eye] + (rest - EYE_PLACES[eye]) @ turns.transpose(0, 2, 1)


@pytest.mark.parametrize("unit", [(1.0, "Y"), (0.01, "Z")])
def test_each_eye_turns_in_a_head_that_turns(
    tmp_path: Path, take: WeightsTake, unit: tuple[float, str]
) -> None:
    path = processed(tmp_path, take, unit)
    rig = with_eyes(make_world().rig)
    pivot = rig.skeleton.bind[1, 3, :3]
    head = Rotation.from_rotvec(TURNS).as_matrix()
    for i in (1, 2):
        inside = turned(take, rig.meshes[i].points, i - 1)
        expected = pivot + (inside - pivot) @ head.transpose(0, 2, 1)
        for shown in judged(path, take):
            np.testing.assert_allclose(shown[i], expected, atol=1e-6)


def test_eyes_alone_turn_where_the_head_stays(tmp_path: Path, take: WeightsTake) -> None:
    still = replace(take, head=None)
    path = processed(tmp_path, still)
    rig = with_eyes(make_world().rig)
    for face, *eyes in judged(path, still):
        np.testing.assert_allclose(face, np.tile(rig.meshes[0].points, (FRAMES, 1, 1)), atol=1e-6)
        for i, eye in enumerate(eyes):
            np.testing.assert_allclose(eye, turned(take, rig.meshes[i + 1].points, i), atol=1e-6)
