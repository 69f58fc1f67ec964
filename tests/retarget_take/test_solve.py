"""Films: neutral frames that show something, and faces with blend shapes of their own."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, filmed, make_world

from usdface.face.bound_face import bound_face
from usdface.face.marker_surface import MarkerSurface
from usdface.options import MapOptions, SolveOptions
from usdface.retarget.solution import Solution
from usdface.retarget_take.solve import solve
from usdface.takes import MarkerTake

WORLD = make_world(head_moves=False)
SHOWN = {"jawOpen": 0.2, "browDownLeft": 0.2}


def showing(shown: dict[str, float]) -> World:
    """The world, twice as long, with neutral frames that show some weights."""
    mesh = WORLD.rig.meshes[0]
    weights = np.concatenate([WORLD.weights, WORLD.weights[NEUTRAL:][::-1]])
    weights[:NEUTRAL] = [shown.get(name, 0.0) for name in mesh.shape_names]
    vertices = list(WORLD.points.values())
    positions = mesh.points[vertices] + np.tensordot(weights, mesh.offsets_at(vertices), axes=1)
    times = np.arange(len(weights)) / WORLD.take.rate
    take = replace(WORLD.take, positions=positions, times=times)
    return replace(WORLD, take=take, weights=weights)


def film(world: World) -> MarkerTake:
    return replace(filmed(world.take), focal_length=1300.0)


def solved(
    world: World, take: MarkerTake | None = None, **changes: object
) -> tuple[Solution, list[str], float]:
    """Return the solution of the world's film or another, the findings, and the weights' RMS error.

    `changes` are of the setup.
    """
    setup = replace(world.setup(neutral=(0, NEUTRAL - 1)), **changes)
    take = film(world) if take is None else take
    face = bound_face(world.rig.meshes[0], setup)
    solution, findings = solve(take, face, setup, cleaned=None)
    error = float(np.sqrt(np.mean((solution.weights.weights - world.weights) ** 2)))
    return solution, [each.code for each in findings], error


def test_weights_of_the_neutral_frames_of_a_film_are_found() -> None:
    world = showing(SHOWN)
    solution, codes, error = solved(world)
    assert codes.count("NEUTRAL_SHOWS") == 1 and solution.filmed is not None
    assert solution.dimension == 2 and solution.posed_in_space
    for name, weight in SHOWN.items():
        assert solution.neutral_weights[name] == pytest.approx(weight, abs=0.06)
    given = solved(world, solve=SolveOptions(neutral="given"))
    assert not given[0].neutral_weights and "NEUTRAL_SHOWS" not in given[1]
    assert error < 0.4 * given[2]
    # The resting face of the head before the camera is that of the character.
    rest = WORLD.rig.meshes[0].points[list(WORLD.points.values())]
    off = np.abs(solution.filmed.rest - rest).max()
    assert off < 0.5 * np.abs(given[0].filmed.rest - rest).max()


@pytest.mark.slow
def test_weights_of_the_neutral_frames_of_a_film_may_be_named() -> None:
    world = showing(SHOWN)
    given = solved(world, solve=SolveOptions(neutral="given"))
    named = solved(world, neutral_weights=SHOWN)
    assert named[2] < 0.4 * given[2] and "NEUTRAL_SHOWS" not in named[1]


def test_a_neutral_film_shows_nothing() -> None:
    solution, codes, _ = solved(showing({}))
    assert not solution.neutral_weights and "NEUTRAL_SHOWS" not in codes


@pytest.mark.parametrize(
    "marker",
    ["cheek_l", *(pytest.param(m, marks=pytest.mark.slow) for m in ("brow_mid_r", "corner_r"))],
)
def test_a_dot_that_jumps_is_no_expression_of_the_neutral(marker: str) -> None:
    """Its track is another spot's from the middle of the film on."""
    world = showing({})
    take = film(world)
    positions = take.positions + np.random.default_rng(0).normal(0.0, 0.1, take.positions.shape)
    positions[len(positions) // 2 :, take.names.index(marker)] += [5.0, -8.0]
    solution, codes, _ = solved(world, replace(take, positions=positions))
    assert "MARKER_INACCURATE" in codes
    assert not solution.neutral_weights and "NEUTRAL_SHOWS" not in codes


def test_blend_shapes_are_transferred_to_the_filmed_face_unless_the_map_is_fixed() -> None:
    mesh, vertices = WORLD.rig.meshes[0], list(WORLD.points.values())
    patch = MarkerSurface(mesh, np.array(vertices)).patch
    other = patch.points * [1.1, 0.9, 1.2] + 0.003 * np.sin(30 * patch.points[:, [1, 2, 0]])
    own = patch.transferred(other, mesh.offsets_at(patch.vertices))
    place = patch.place_of[vertices]
    positions = other[place] + np.tensordot(WORLD.weights, own[:, place], axes=1)
    take = film(replace(WORLD, take=replace(WORLD.take, positions=positions)))
    transferred, _, error = solved(WORLD, take)
    fixed, _, fixed_error = solved(WORLD, take, map=MapOptions(choice="fixed"))
    assert transferred.choice.as_dict()["shapes"] == "transferred"
    assert fixed.choice.as_dict()["shapes"] == "character"
    assert error < 0.9 * fixed_error
    # On the character's own face both are the same.
    own_face, given = solved(WORLD)[2], solved(WORLD, map=MapOptions(choice="fixed"))[2]
    assert abs(own_face - given) < 0.02 * fixed_error
