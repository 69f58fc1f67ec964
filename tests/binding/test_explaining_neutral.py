"""The neutral among held poses, where the face is hardly ever at rest."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import World, filmed, make_world

from usdface.binding.bound_neutral import bound_neutral
from usdface.binding.neutral_frames import neutral_frames
from usdface.face.bound_face import BoundFace, bound_face
from usdface.takes import MarkerTake

RATE, NOISE = 60.0, 1e-4
REST = 24  # frames


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(head_moves=False)


@pytest.fixture(scope="module")
def face(world: World) -> BoundFace:
    return bound_face(world.rig.meshes[0], world.setup())


def concentrated(world: World, rest_at: int) -> MarkerTake:
    """Ten seconds of a performer with lowered brows and lids, at rest only once.

    Expressions come and go, the performer returns to the lowered brows.
    """
    frames = 600
    names = list(world.rig.meshes[0].shape_names)
    usual = np.zeros(len(names))
    for name, weight in (("browDown", 0.3), ("eyeBlink", 0.25), ("mouthFrown", 0.2)):
        usual[[names.index(f"{name}{side}") for side in ("Left", "Right")]] = weight
    time = np.arange(frames) / RATE
    weights = np.repeat(usual[None], frames, axis=0)
    for start, name in enumerate(("jawOpen", "mouthSmile", "browInnerUp", "browOuterUp")):
        bump = np.exp(-(((time - 1.5 - 2.2 * start) / 0.3) ** 2))
        for column in (k for k, each in enumerate(names) if each.startswith(name)):
            weights[:, column] += 0.8 * bump
    fade = np.abs(np.arange(frames) - rest_at) - REST
    weights *= np.clip(fade / 10.0, 0.0, 1.0)[:, None]
    points = np.array(list(world.points.values()))
    mesh = world.rig.meshes[0]
    positions = mesh.points[points] + np.einsum("fs,smd->fmd", weights, mesh.offsets_at(points))
    noise = np.random.default_rng(4).normal(size=positions.shape)
    return MarkerTake(tuple(world.points), time, positions + NOISE * noise, RATE)


@pytest.mark.parametrize("rest_at", [0, 300, 599])
def test_a_rest_is_found_though_another_pose_is_held_for_most_of_the_take(
    world: World, face: BoundFace, rest_at: int
) -> None:
    take = concentrated(world, rest_at)
    first, last = bound_neutral(take, face)
    assert rest_at - REST - 3 <= first <= last <= rest_at + REST + 3
    assert last - first >= 6


@pytest.mark.parametrize("rest_at", [0, 300, 599])
def test_a_rest_is_found_in_the_image_of_one_camera(
    world: World, face: BoundFace, rest_at: int
) -> None:
    take = filmed(concentrated(world, rest_at))
    first, last = bound_neutral(take, face)
    assert rest_at - REST - 3 <= first <= last <= rest_at + REST + 3
    assert last - first >= 6


SLOW = [pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 4)]


@pytest.mark.parametrize("seed", [0, *SLOW])
def test_wild_detections_in_an_image_do_not_hide_the_rest(
    world: World, face: BoundFace, seed: int
) -> None:
    take = filmed(concentrated(world, 300))
    positions = take.positions.copy()
    wild = np.random.default_rng(seed).random((2, len(take.names), 2))
    positions[[120, 480]] = [900.0, -900.0] * wild
    first, last = bound_neutral(replace(take, positions=positions), face)
    assert 300 - REST - 3 <= first <= last <= 300 + REST + 3


def test_markers_alone_take_the_pose_that_is_held_most(world: World) -> None:
    assert neutral_frames(concentrated(world, 599))[1] < 599 - REST


def test_markers_that_a_pose_does_not_show_tell_nothing_of_it(
    world: World, face: BoundFace
) -> None:
    take = concentrated(world, 300)
    positions = take.positions.copy()
    positions[300 - REST : 300 + REST, take.names.index("corner_l")] = np.nan
    positions[450:, take.names.index("lid_r")] = np.nan
    hidden = MarkerTake(take.names, take.times, positions, take.rate)
    first, last = bound_neutral(hidden, face)
    assert 300 - REST - 3 <= first <= last <= 300 + REST + 3


def acted(world: World, seed: int) -> tuple[MarkerTake, np.ndarray]:
    """Fourteen poses of two blend shapes, each held for 0.6 s, and a quarter of a second of rest.

    The second value is the weights (F, S).
    """
    rng = np.random.default_rng(seed)
    mesh = world.rig.meshes[0]
    count = len(mesh.shapes)
    ramp = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 16)))[:, None]
    parts = [np.zeros((30, count))]
    for _ in range(14):
        pose = np.zeros(count)
        pose[rng.permutation(count)[:2]] = rng.uniform(0.5, 0.9, 2)
        parts += [ramp * pose, np.tile(pose, (36, 1)), ramp[::-1] * pose, np.zeros((15, count))]
    weights = np.concatenate(parts)
    points = np.array(list(world.points.values()))
    positions = mesh.points[points] + np.einsum("fs,smd->fmd", weights, mesh.offsets_at(points))
    positions += NOISE * rng.normal(size=positions.shape)
    times = np.arange(len(weights)) / RATE
    return MarkerTake(tuple(world.points), times, positions, RATE), weights


@pytest.mark.parametrize(("count", "seed"), [(5, 4), (5, 9), (5, 10), (7, 0)])
def test_poses_that_a_rig_has_no_blend_shapes_for_are_not_its_neutral(
    world: World, count: int, seed: int
) -> None:
    mesh = world.rig.meshes[0]
    kept = np.sort(np.random.default_rng(100 + seed).permutation(len(mesh.shapes))[:count])
    few = replace(mesh, shapes=tuple(mesh.shapes[k] for k in kept))
    take, weights = acted(world, seed)
    first, last = bound_neutral(take, bound_face(few, world.setup()))
    assert np.abs(weights[first : last + 1].mean(axis=0)).max() < 0.05
