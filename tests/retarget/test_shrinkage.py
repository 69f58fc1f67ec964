"""The factor that undoes the solve's shrinkage of the brows: a least-squares slope."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import World, make_world

import usdface
from usdface import ProcessOptions, Shot, ShotResult
from usdface.arrays import FloatArray
from usdface.geometry.rigid_modes import small_motions
from usdface.io.bind_file import setup_of_json
from usdface.retarget.shrinkage import brow_factor
from usdface.retarget.solution import Solution

NAMES = make_world().rig.shape_names
BROWS = np.array([name.startswith("brow") for name in NAMES])


def retargeted(world: World, **more: object) -> ShotResult:
    setup = setup_of_json(world.bind | more, "bind.json")
    shot, _ = usdface.assemble_shot(world.rig, world.take, setup=setup)
    return usdface.retarget(shot, options=ProcessOptions(express=False))


@pytest.fixture(scope="module")
def exact() -> ShotResult:
    return retargeted(make_world())


def solution_of(result: ShotResult) -> Solution:
    assert result.solution is not None
    return result.solution


def shrunk(result: ShotResult, share: float, shapes: FloatArray = BROWS) -> Solution:
    """Return the solution with smaller weights for the same markers."""
    solution = solution_of(result)
    weights = solution.weights.weights * np.where(shapes, share, 1.0)
    return replace(solution, weights=replace(solution.weights, weights=weights))


def factor_of(shot: Shot, solution: Solution, moving_head: bool = True) -> float:
    return brow_factor(solution, shot.mesh, moving_head=moving_head)


def moved(solution: Solution, by: FloatArray) -> Solution:
    return replace(solution, feature_points=solution.feature_points + by)


@pytest.mark.parametrize("share", [1.0, 0.9, 0.75, 0.6])
def test_it_is_the_slope_from_solved_to_shown_brows(exact: ShotResult, share: float) -> None:
    """A little less, the smaller the motion: half a millimetre counts by a half."""
    found = factor_of(exact.shot, shrunk(exact, share))
    assert 1.0 + 0.7 * (1.0 / share - 1.0) - 1e-6 <= found <= 1.0 / share + 1e-6


def test_it_is_between_1_and_2(exact: ShotResult) -> None:
    solution = solution_of(exact)
    larger = moved(solution, 2.0 * solution.displacements)
    assert factor_of(exact.shot, larger) == 2.0
    assert factor_of(exact.shot, shrunk(exact, 1.5)) == 1.0


def test_motion_that_the_brows_cannot_make_changes_nothing(exact: ShotResult) -> None:
    """At right angles to all that they do at each marker, and as large."""
    solution = shrunk(exact, 0.7)
    assert solution.model is not None
    motion = solution.model.displacements(np.where(BROWS, solution.weights.weights, 0.0))
    motion = motion.reshape(solution.feature_points.shape)
    sideways = moved(solution, np.cross(motion, [0.6, 0.0, 0.8]))
    before = factor_of(exact.shot, solution, moving_head=False)
    assert factor_of(exact.shot, sideways, moving_head=False) == pytest.approx(before, abs=1e-3)


def test_a_mouth_that_was_shrunk_and_a_nodding_head_say_nothing(exact: ShotResult) -> None:
    mouth = np.array([name.startswith(("mouth", "jaw")) for name in NAMES])
    assert mouth.any()
    assert factor_of(exact.shot, shrunk(exact, 0.5, mouth)) == pytest.approx(1.0, abs=0.01)
    solution = shrunk(exact, 0.7)
    nod = small_motions(solution.rest, image=False)[3]
    nodding = moved(
        solution, 0.1 * solution.weights.weights[:, BROWS].sum(axis=1)[:, None, None] * nod
    )
    still = factor_of(exact.shot, solution)
    assert factor_of(exact.shot, nodding) == pytest.approx(still, abs=1e-9)


def test_occluded_markers_have_no_say(exact: ShotResult) -> None:
    """Where the rig predicts them, they agree with whatever was solved."""
    solution = shrunk(exact, 0.7)
    distances = solution.distances.copy()
    distances[::2] = np.nan
    points = solution.feature_points.copy()
    points[::2] = 1.0
    hidden = replace(solution, distances=distances, feature_points=points)
    whole = factor_of(exact.shot, solution)
    assert factor_of(exact.shot, hidden) == pytest.approx(whole, rel=0.05)


def test_brows_at_rest_in_noise_stay_as_solved(exact: ShotResult) -> None:
    solution = shrunk(exact, 0.002)
    noise = 3e-4 * np.random.default_rng(0).standard_normal(solution.feature_points.shape)
    still = replace(solution, feature_points=solution.rest + noise)
    assert factor_of(exact.shot, still) < 1.05


def sideways_world(share: float) -> World:
    """A performer whose brows go outwards by a share of their way up; the rig's only rise."""
    world = make_world()
    take, neutral = world.take, world.take.positions[:1]
    positions = take.positions.copy()
    brows = [i for i, name in enumerate(take.names) if "brow" in name]
    assert brows
    up = positions[:, brows, 1] - neutral[:, brows, 1]
    positions[:, brows, 0] += share * up * np.sign(neutral[:, brows, 0])
    return replace(world, take=replace(take, positions=positions))


def test_brows_that_go_another_way_are_as_large_as_the_markers_show() -> None:
    world = sideways_world(1.5)
    plain = retargeted(world, head="stabilised", solve={"shrinkage": "kept"})
    result = retargeted(world, head="stabilised")
    truth = make_world().weights[:, BROWS]

    def slope(shot: ShotResult) -> float:
        own = shot.solved.weights[:, BROWS]
        return float((own * truth).sum() / (truth**2).sum())

    assert slope(plain) < 0.9
    assert slope(plain) < slope(result) < 1.1
    others = ~BROWS
    np.testing.assert_array_equal(result.solved.weights[:, others], plain.solved.weights[:, others])
    codes = [finding.code for finding in result.findings]
    assert "BROWS_RESTORED" in codes
    assert "BROWS_RESTORED" not in [finding.code for finding in plain.findings]
