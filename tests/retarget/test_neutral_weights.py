from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import Inbetween
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.errors import InputError
from usdface.face.bound_face import bound_face
from usdface.findings import Finding
from usdface.options import MapOptions, SolveOptions
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.neutral_weights import (
    LARGEST,
    neutral_weight_findings,
    weights_at_limit,
    without_weights,
)
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

MOUTH = 0.3
SHOWN = {"jawOpen": 0.2, "browDownLeft": 0.15}


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def parts(world: World) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Vertices of the take's markers, their places on the character, what the shapes do there."""
    mesh = world.rig.meshes[0]
    vertices = np.array([world.points[name] for name in world.take.names])
    return vertices, mesh.points[vertices], mesh.offsets_at(vertices)


def solved(
    world: World, take: MarkerTake, **changes: object
) -> tuple[Solution, list[Finding], FloatArray]:
    """Return solution, findings and weights; `changes` are of the setup."""
    vertices, points, offsets = parts(world)
    setup = RetargetSetup(Binding(take.names, vertices), neutral=(0, NEUTRAL - 1))
    setup = replace(setup, **changes)
    solution, findings = solve_take(
        take, BoundPoints.linear(points, offsets, world.rig.meshes[0].shape_names), setup
    )
    return solution, findings, solution.weights.weights


def showing(
    world: World, shown: dict[str, float], noise: float = 0.0
) -> tuple[MarkerTake, FloatArray]:
    """Return a take whose neutral frames show some weights, and the true weights of all frames."""
    _, points, offsets = parts(world)
    names = world.rig.meshes[0].shape_names
    weights = np.concatenate([world.weights, world.weights[NEUTRAL:][::-1]])
    weights[:NEUTRAL] = [shown.get(name, 0.0) for name in names]
    positions = points + np.tensordot(weights, offsets, axes=1)
    positions = positions + noise * np.random.default_rng(0).standard_normal(positions.shape)
    times = np.arange(len(weights)) / world.take.rate
    return replace(world.take, positions=positions, times=times), weights


def neutral_weights_of(
    positions: FloatArray, points: FloatArray, offsets: FloatArray
) -> dict[str, float]:
    """Return the neutral weights found for markers (F, M, 3) on shapes s0, s1, ... at 30 Hz."""
    names = tuple(f"m{i}" for i in range(len(points)))
    take = MarkerTake(names, np.arange(len(positions)) / 30.0, positions, 30.0)
    setup = RetargetSetup(Binding(names, np.arange(len(points))), neutral=(0, NEUTRAL - 1))
    shapes = tuple(f"s{i}" for i in range(len(offsets)))
    solution, _ = solve_take(take, BoundPoints.linear(points, offsets, shapes), setup)
    return dict(solution.neutral_weights)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def codes(findings: list[Finding]) -> list[str]:
    return [each.code for each in findings]


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_a_neutral_face_shows_nothing(world: World, noise: float) -> None:
    solution, findings, _ = solved(world, showing(world, {}, noise)[0])
    assert not solution.neutral_weights and "NEUTRAL_SHOWS" not in codes(findings)


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_weights_of_the_neutral_frames_are_found_and_taken_off(world: World, noise: float) -> None:
    take, truth = showing(world, SHOWN, noise)
    solution, findings, weights = solved(world, take)
    for name, weight in SHOWN.items():
        assert solution.neutral_weights[name] == pytest.approx(weight, abs=0.05)
    assert sum(solution.neutral_weights.values()) < 1.2 * sum(SHOWN.values())
    as_given = solved(world, take, solve=SolveOptions(neutral="given"))[2]
    assert rms(weights - truth) < 0.5 * rms(as_given - truth)
    (shows,) = (each for each in findings if each.code == "NEUTRAL_SHOWS")
    assert shows.severity == "info" and "most: jawOpen 0." in shows.message
    assert shows.values["shapes"][:2] == list(SHOWN)


def test_neutral_frames_that_are_given_are_kept(world: World) -> None:
    take, _ = showing(world, SHOWN)
    solution, findings, weights = solved(world, take, solve=SolveOptions(neutral="given"))
    assert not solution.neutral_weights and "NEUTRAL_SHOWS" not in codes(findings)
    assert weights[:NEUTRAL].max() < 0.02


def test_weights_that_are_given_with_the_frames_are_all_of_them(world: World) -> None:
    take, _ = showing(world, SHOWN)
    given = {"jawOpen": 0.1}
    solution, findings, weights = solved(world, take, neutral_weights=given)
    assert dict(solution.neutral_weights) == given and "NEUTRAL_SHOWS" not in codes(findings)
    assert weights[0, 0] == pytest.approx(0.1, abs=0.03)


def test_a_frame_that_is_no_neutral_is_found_to_show_it(world: World) -> None:
    frame = int(np.argmin(np.abs(world.weights.max(axis=1) - MOUTH)))
    solution, _, _ = solved(world, world.take, neutral=(frame, frame))
    names, shown = world.rig.meshes[0].shape_names, world.weights[frame]
    found = np.array([solution.neutral_weights.get(name, 0.0) for name in names])
    assert shown.max() > 0.15
    assert np.linalg.norm(found - shown) < 0.5 * np.linalg.norm(shown)


@pytest.mark.parametrize(("seed", "opposed"), [(0, 0.0), (1, 0.0), (5, 0.0), (0, 0.4), (2, 0.3)])
def test_a_performer_with_other_movements_shows_nothing_at_rest(seed: int, opposed: float) -> None:
    """Weights of up to 0.25 would explain a little of what is the difference of two faces.

    Where one of the performer's movements goes `opposed` to another blend shape by a part, the rig
    would need a negative weight.
    """
    rng = np.random.default_rng(seed)
    points, offsets = 0.06 * rng.normal(size=(20, 3)), 0.006 * rng.normal(size=(8, 20, 3))
    unlike, count, power = (0.001, 300, 3) if opposed else (0.0036, 150, 1)
    own = offsets + unlike * rng.normal(size=offsets.shape)
    own[1] -= opposed * offsets[0]
    waves = np.linspace(0, 1, count)[:, None] * rng.uniform(1, 4, 8) + rng.uniform(0, 1, 8)
    weights = np.sin(2 * np.pi * waves).clip(min=0.0) ** power
    weights[:NEUTRAL] = 0.0
    positions = points + np.tensordot(weights, own, axes=1)
    assert not neutral_weights_of(positions, points, offsets)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_single_movement_that_the_rig_lacks_is_no_expression_of_the_neutral(seed: int) -> None:
    """It goes against another blend shape for a second of ten; a neutral weight of 0.24 would fit.

    All movements would leave an expression of the neutral, not this one alone.
    """
    rng = np.random.default_rng(seed)
    points, offsets = 0.06 * rng.normal(size=(20, 3)), 0.006 * rng.normal(size=(8, 20, 3))
    own = offsets + 0.0005 * rng.normal(size=offsets.shape)
    own[1] -= 0.4 * offsets[0]
    waves = np.linspace(0, 1, 300)[:, None] * rng.uniform(3, 6, 8) + rng.uniform(0, 1, 8)
    weights = np.sin(2 * np.pi * waves).clip(min=0.0) ** 3
    weights[:NEUTRAL] = weights[:, 1] = weights[100:140, 0] = 0.0
    weights[100:140, 1] = np.sin(np.linspace(0, np.pi, 40))
    positions = points + np.tensordot(weights, own, axes=1)
    assert not neutral_weights_of(positions, points, offsets)


@pytest.mark.parametrize(("seed", "opposed"), [(0, 0.2), (1, 0.4), (2, 0.4)])
def test_a_movement_exactly_against_a_shape_is_none_either(seed: int, opposed: float) -> None:
    """A neutral weight would explain all of it: the rig has no wide eyes, which go for a second."""
    rng = np.random.default_rng(seed)
    points, offsets = 0.06 * rng.normal(size=(20, 3)), 0.006 * rng.normal(size=(8, 20, 3))
    waves = np.linspace(0, 1, 300)[:, None] * rng.uniform(3, 6, 8) + rng.uniform(0, 1, 8)
    weights = np.sin(2 * np.pi * waves).clip(min=0.0) ** 3
    weights[:NEUTRAL] = 0.0
    weights[100:130, 0] = -opposed * np.sin(np.linspace(0, np.pi, 30))
    positions = points + np.tensordot(weights, offsets, axes=1)
    positions += 2e-4 * rng.normal(size=positions.shape)
    assert not neutral_weights_of(positions, points, offsets)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_small_weight_is_found_though_few_movements_leave_it(seed: int) -> None:
    """The shape that shows 0.05 is above it for all but a second of ten."""
    rng = np.random.default_rng(seed)
    points, offsets = 0.06 * rng.normal(size=(20, 3)), 0.02 * rng.normal(size=(8, 20, 3))
    waves = np.linspace(0, 1, 300)[:, None] * rng.uniform(3, 6, 8) + rng.uniform(0, 1, 8)
    weights = np.sin(2 * np.pi * waves).clip(min=0.0) ** 3
    weights[:, 0] = 0.3
    weights[:NEUTRAL] = weights[100:140, 0] = 0.0
    weights[:NEUTRAL, 0] = 0.05
    positions = points + np.tensordot(weights, offsets, axes=1)
    assert neutral_weights_of(positions, points, offsets) == {"s0": pytest.approx(0.05, abs=0.01)}


def test_too_few_frames_say_nothing(world: World) -> None:
    take, _ = showing(world, SHOWN)
    assert solved(world, take)[0].neutral_weights
    short = replace(take, positions=take.positions[:9], times=take.times[:9])
    assert not solved(world, short)[0].neutral_weights


def test_an_occluded_marker_is_no_evidence(world: World) -> None:
    take, _ = showing(world, SHOWN)
    positions = take.positions.copy()
    positions[20:35, take.names.index("brow_mid_r")] = np.nan
    found = solved(world, replace(take, positions=positions))[0].neutral_weights
    for name, weight in SHOWN.items():
        assert found[name] == pytest.approx(weight, abs=0.06)


def test_the_order_of_the_markers_does_not_matter(world: World) -> None:
    take, _ = showing(world, SHOWN, 3e-4)
    found = solved(world, take)[0].neutral_weights
    order = np.random.default_rng(1).permutation(len(take.names))
    names = tuple(take.names[i] for i in order)
    mixed = replace(take, names=names, positions=take.positions[:, order])
    vertices, points, offsets = parts(world)
    setup = RetargetSetup(Binding(names, vertices[order]), neutral=(0, NEUTRAL - 1))
    shape_names = world.rig.meshes[0].shape_names
    again, _ = solve_take(
        mixed, BoundPoints.linear(points[order], offsets[:, order], shape_names), setup
    )
    assert dict(again.neutral_weights) == dict(found)


def test_a_performers_file_tells_the_size_of_the_shapes(world: World) -> None:
    """Neutral weights are of the character's shapes, and take the place of the file's offset."""
    names = world.rig.meshes[0].shape_names
    jaw = np.array([name == "jawOpen" for name in names])
    performer = Calibration(names, np.where(jaw, 0.8, 1.0), np.where(jaw, 0.05, 0.0))
    take, _ = showing(world, {"jawOpen": 0.2})
    found = solved(world, take, calibration=performer)[0].neutral_weights
    assert found["jawOpen"] == pytest.approx(0.2, abs=0.04)
    wide = replace(performer, gains=np.where(jaw, 1.5, 1.0))
    take, _ = showing(world, {"jawOpen": 0.9})
    solution, findings, _ = solved(world, take, calibration=wide)
    assert solution.neutral_weights["jawOpen"] == LARGEST
    assert "NEUTRAL_AT_LIMIT" in codes(findings)


def test_an_inbetween_shows_at_the_weight_of_its_path(world: World) -> None:
    """With an inbetween that is at 0.6 of it at weight 0.2, 0.3 shows at weight 0.1 already."""
    mesh = world.rig.meshes[0]
    vertices, points, _ = parts(world)
    jaw = mesh.shape_names.index("jawOpen")
    early = Inbetween("early", 0.2, 0.6 * mesh.shapes[jaw].offsets)
    shapes = list(mesh.shapes)
    shapes[jaw] = replace(shapes[jaw], inbetweens=(early,))
    model, _ = evaluator_of(tuple(shapes), vertices)
    take, _ = showing(world, {"jawOpen": 0.3})
    setup = RetargetSetup(Binding(take.names, vertices), neutral=(0, NEUTRAL - 1))
    solution, _ = solve_take(take, BoundPoints(points, mesh.shape_names, model), setup)
    assert solution.neutral_weights["jawOpen"] == pytest.approx(0.1, abs=0.02)


def test_the_papers_map_keeps_the_neutral_frames(world: World) -> None:
    take, _ = showing(world, SHOWN)
    assert not solved(world, take, map=MapOptions(form="paper"))[0].neutral_weights


def test_an_image_shows_weights_that_move_in_it(world: World) -> None:
    take, truth = showing(world, SHOWN)
    flat = replace(take, positions=1000.0 * take.positions[..., :2])
    solution, _, weights = solved(world, flat)
    for name, weight in SHOWN.items():
        assert solution.neutral_weights[name] == pytest.approx(weight, abs=0.06)
    as_given = solved(world, flat, solve=SolveOptions(neutral="given"))[2]
    assert rms(weights - truth) < 0.5 * rms(as_given - truth)


def test_what_is_taken_off_is_what_shows(world: World) -> None:
    """A neutral that shows weights, on a performer twice as large and turned."""
    _, points, offsets = parts(world)
    shown = np.linspace(0, 0.2, len(offsets))
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    rest = 2.0 * (points + np.tensordot(shown, offsets, axes=1)) @ turn.T + [1.0, 2.0, 3.0]
    neutral = 2.0 * points @ turn.T + [1.0, 2.0, 3.0]
    back = without_weights(rest, points, np.tensordot(shown, offsets, axes=1))
    assert np.abs(back - neutral).max() < 0.1 * np.abs(rest - neutral).max()


def test_a_neutral_that_shows_more_than_is_taken_off_is_a_warning(world: World) -> None:
    setup = world.setup(neutral=(3, 9), neutral_weights={"jawOpen": LARGEST, "browInnerUp": 0.2})
    face = bound_face(world.rig.meshes[0], setup)

    def reported(setup: RetargetSetup) -> list[Finding]:
        return neutral_weight_findings(setup, face.evaluator, face.shape_names, "take")

    shows, cut = reported(setup)
    assert shows.code == "NEUTRAL_SHOWS"
    assert (cut.code, cut.severity) == ("NEUTRAL_AT_LIMIT", "warning")
    assert cut.values["shapes"] == ["jawOpen"] and "jawOpen" in cut.message
    less = replace(setup, neutral_weights={"jawOpen": LARGEST - 0.01})
    assert codes(reported(less)) == ["NEUTRAL_SHOWS"]


@pytest.mark.parametrize(("shown", "cut"), [(0.625, False), (0.688, True)])
def test_the_limit_of_a_neutral_weight_follows_the_inbetweens(
    world: World, shown: float, cut: bool
) -> None:
    """Half way it has moved a fifth: 0.5 of the motion is reached at 0.6875."""
    mesh = world.rig.meshes[0]
    shapes = [
        replace(shape, inbetweens=(Inbetween("half", 0.5, 0.2 * shape.offsets),))
        for shape in mesh.shapes
    ]
    face = bound_face(replace(mesh, shapes=tuple(shapes)), world.setup())
    at_limit = weights_at_limit({"jawOpen": shown}, face.evaluator, face.shape_names)
    assert at_limit == ("jawOpen",) * cut


def test_neutral_weights_that_cannot_be_are_one_line(world: World) -> None:
    vertices, points, offsets = parts(world)
    names = world.rig.meshes[0].shape_names
    setup = RetargetSetup(Binding(world.take.names, vertices), neutral=(0, NEUTRAL - 1))
    with pytest.raises(InputError, match="expected 0 to 1"):
        replace(setup, neutral_weights={names[0]: 1.5})
    with pytest.raises(InputError, match="name neutral frames"):
        replace(setup, neutral=None, neutral_weights={names[0]: 0.5})
    with pytest.raises(InputError, match="'noShape'"):
        solve_take(
            world.take,
            BoundPoints.linear(points, offsets, names),
            replace(setup, neutral_weights={"noShape": 0.5}),
        )
