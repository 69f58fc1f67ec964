from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.neutral_weights import estimate_neutral_weights, without_weights
from usdface.retarget.solve_take import solve_take
from usdface.retarget_setup import Binding, RetargetSetup
from usdface.takes import MarkerTake

MOUTH = 0.3


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def at_neutral(take: MarkerTake, points: FloatArray) -> RetargetSetup:
    return RetargetSetup(Binding(take.names, points), neutral=(0, NEUTRAL - 1))


def parts(world: World) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Vertices of the take's markers, their places on the character, what the shapes do there."""
    mesh = world.rig.meshes[0]
    vertices = np.array([world.points[name] for name in world.take.names])
    return vertices, mesh.points[vertices], mesh.offsets_at(vertices)


def estimate(world: World, positions: FloatArray, frames: tuple[int, int]) -> FloatArray:
    _, points, offsets = parts(world)
    return estimate_neutral_weights(positions, neutral_markers(positions, frames), points, offsets)


def test_a_neutral_face_shows_nothing(world: World) -> None:
    found = estimate(world, world.take.positions, (0, NEUTRAL - 1))
    assert not found.any()


def test_what_a_rest_shows_is_found(world: World) -> None:
    """Some frame of the take that is no neutral is said to be one."""
    frame = int(np.argmin(np.abs(world.weights.max(axis=1) - MOUTH)))
    shown = world.weights[frame]
    found = estimate(world, world.take.positions, (frame, frame))
    assert shown.max() > 0.15
    assert np.linalg.norm(found - shown) < 0.5 * np.linalg.norm(shown)


@pytest.mark.parametrize("seed", [0, 1, 5])
def test_a_performer_with_other_movements_shows_nothing_at_rest(seed: int) -> None:
    """Weights of up to 0.25 would explain a little of what is the difference of two faces."""
    rng = np.random.default_rng(seed)
    points, offsets = 0.06 * rng.normal(size=(20, 3)), 0.006 * rng.normal(size=(8, 20, 3))
    own = offsets + 0.0036 * rng.normal(size=offsets.shape)
    waves = np.linspace(0, 1, 150)[:, None] * rng.uniform(1, 4, 8) + rng.uniform(0, 1, 8)
    take = points + np.tensordot(np.sin(2 * np.pi * waves).clip(min=0.0), own, 1)
    assert not estimate_neutral_weights(take, points, points, offsets).any()


def test_too_few_markers_or_frames_say_nothing(world: World) -> None:
    few = world.take.positions.copy()
    few[:, 6:] = np.nan
    assert not estimate(world, few, (20, 20)).any()
    assert not estimate(world, world.take.positions[:8], (5, 5)).any()


def test_taking_the_rest_off_is_what_it_shows(world: World) -> None:
    """A rest that shows weights, on a performer twice as large and turned."""
    _, points, offsets = parts(world)
    shown = np.linspace(0, 0.2, len(offsets))
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    rest = 2.0 * (points + np.tensordot(shown, offsets, axes=1)) @ turn.T + [1.0, 2.0, 3.0]
    neutral = 2.0 * points @ turn.T + [1.0, 2.0, 3.0]
    back = without_weights(rest, points, np.tensordot(shown, offsets, axes=1))
    assert np.abs(back - neutral).max() < 0.1 * np.abs(rest - neutral).max()


def test_a_solve_with_the_weights_of_its_neutral_gives_them_back(world: World) -> None:
    vertices, points, offsets = parts(world)
    names = world.rig.meshes[0].shape_names
    frame = int(np.argmin(np.abs(world.weights.max(axis=1) - MOUTH)))
    shown = dict(zip(names, world.weights[frame].tolist(), strict=True))
    setup = replace(at_neutral(world.take, vertices), neutral=(frame, frame))

    def error(setup: RetargetSetup) -> float:
        solution, _ = solve_take(world.take, points, offsets, names, setup)
        return float(np.sqrt(np.mean((solution.weights.weights - world.weights) ** 2)))

    assert error(replace(setup, neutral_weights=shown)) < 0.5 * error(setup)


def test_neutral_weights_that_cannot_be_are_one_line(world: World) -> None:
    vertices, points, offsets = parts(world)
    names = world.rig.meshes[0].shape_names
    setup = at_neutral(world.take, vertices)
    with pytest.raises(InputError, match="expected 0 to 1"):
        replace(setup, neutral_weights={names[0]: 1.5})
    with pytest.raises(InputError, match="name neutral frames"):
        replace(setup, neutral=None, neutral_weights={names[0]: 0.5})
    with pytest.raises(InputError, match="'noShape'"):
        solve_take(
            world.take, points, offsets, names, replace(setup, neutral_weights={"noShape": 0.5})
        )
    flat = replace(world.take, positions=world.take.positions[..., :2])
    with pytest.raises(InputError, match="2D take"):
        solve_take(flat, points, offsets, names, replace(setup, neutral_weights={names[0]: 0.5}))
