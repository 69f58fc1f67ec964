"""The factor that undoes the solve's shrinkage of the brows: a least-squares slope."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from worlds import World, make_world

import usdface
from usdface import ProcessOptions, ShotResult
from usdface.arrays import FloatArray
from usdface.geometry.rigid_modes import small_motions
from usdface.io.bind_file import setup_of_json
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.shrinkage import brow_factor
from usdface.retarget.solution import Solution
from usdface.setup.pin import Pin

NAMES = make_world().rig.shape_names
BROWS = np.array([name.startswith("brow") for name in NAMES])


def retargeted(world: World, pins: tuple[Pin, ...] = (), **more: object) -> ShotResult:
    setup = replace(setup_of_json(world.bind | more, "bind.json"), pins=pins)
    shot, _ = usdface.assemble_shot(world.rig, world.take, setup=setup)
    return usdface.retarget(shot, options=ProcessOptions(express=False))


def kept(world: World, **more: Any) -> ShotResult:
    return retargeted(world, solve={"shrinkage": "kept"}, **more)


@pytest.fixture(scope="module")
def exact() -> ShotResult:
    return kept(make_world())


def solution_of(result: ShotResult) -> Solution:
    assert result.solution is not None
    return result.solution


def shrunk(result: ShotResult, share: float, shapes: FloatArray = BROWS) -> Solution:
    """Return the solution with smaller weights for the same markers."""
    solution = solution_of(result)
    weights = solution.weights.weights * np.where(shapes, share, 1.0)
    return replace(solution, weights=replace(solution.weights, weights=weights))


def factor_of(solution: Solution, moving_head: bool = True) -> float:
    displaced = np.where(np.isnan(solution.distances)[..., None], np.nan, solution.displacements)
    motion = MotionModel(solution.rest, solution.model, 3, moving_head)
    return brow_factor(solution.weights.weights, displaced, motion, BROWS)


def moved(solution: Solution, by: FloatArray) -> Solution:
    return replace(solution, feature_points=solution.feature_points + by)


@pytest.mark.parametrize("share", [1.0, 0.9, 0.75, 0.6])
def test_it_is_the_slope_from_solved_to_shown_brows(exact: ShotResult, share: float) -> None:
    """A little less, the smaller the motion: half a millimetre counts by a half."""
    found = factor_of(shrunk(exact, share))
    assert 1.0 + 0.7 * (1.0 / share - 1.0) - 1e-6 <= found <= 1.0 / share + 1e-6


def test_it_is_between_1_and_2(exact: ShotResult) -> None:
    solution = solution_of(exact)
    larger = moved(solution, 2.0 * solution.displacements)
    assert factor_of(larger) == 2.0
    assert factor_of(shrunk(exact, 1.5)) == 1.0


def test_motion_that_the_brows_cannot_make_changes_nothing(exact: ShotResult) -> None:
    """At right angles to all that they do at each marker, and as large."""
    solution = shrunk(exact, 0.7)
    motion = solution.model.displacements(np.where(BROWS, solution.weights.weights, 0.0))
    motion = motion.reshape(solution.feature_points.shape)
    sideways = moved(solution, np.cross(motion, [0.6, 0.0, 0.8]))
    before = factor_of(solution, moving_head=False)
    assert factor_of(sideways, moving_head=False) == pytest.approx(before, abs=1e-3)


def test_a_mouth_that_was_shrunk_and_a_nodding_head_say_nothing(exact: ShotResult) -> None:
    mouth = np.array([name.startswith(("mouth", "jaw")) for name in NAMES])
    assert mouth.any()
    assert factor_of(shrunk(exact, 0.5, mouth)) == pytest.approx(1.0, abs=0.01)
    solution = shrunk(exact, 0.7)
    nod = small_motions(solution.rest, image=False)[3]
    nodding = moved(
        solution, 0.1 * solution.weights.weights[:, BROWS].sum(axis=1)[:, None, None] * nod
    )
    still = factor_of(solution)
    assert factor_of(nodding) == pytest.approx(still, abs=1e-9)


def test_occluded_markers_have_no_say(exact: ShotResult) -> None:
    """Where the rig predicts them, they agree with whatever was solved."""
    solution = shrunk(exact, 0.7)
    distances = solution.distances.copy()
    distances[::2] = np.nan
    points = solution.feature_points.copy()
    points[::2] = 1.0
    hidden = replace(solution, distances=distances, feature_points=points)
    whole = factor_of(solution)
    assert factor_of(hidden) == pytest.approx(whole, rel=0.05)


def test_brows_at_rest_in_noise_stay_as_solved(exact: ShotResult) -> None:
    solution = shrunk(exact, 0.002)
    noise = 3e-4 * np.random.default_rng(0).standard_normal(solution.feature_points.shape)
    still = replace(solution, feature_points=solution.rest + noise)
    assert factor_of(still) < 1.05


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
    plain = kept(world, head="stabilised")
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


def test_no_peak_is_cut_off_and_pins_stay() -> None:
    world = sideways_world(1.5)
    pin = Pin("browInnerUp", np.array([30]), np.array([0.25]))
    plain, result = (way(world, head="stabilised", pins=(pin,)) for way in (kept, retargeted))
    before, after = plain.solved.weights[:, BROWS], result.solved.weights[:, BROWS]
    assert (after.max(axis=0) > before.max(axis=0)).any()
    assert ((after >= 1.0) <= (before >= 0.99)).all()
    assert result.solved.column("browInnerUp")[30] == 0.25


def test_residual_and_weights_are_of_one_face() -> None:
    result = retargeted(sideways_world(1.5), head="stabilised", solve={"places": "bound"})
    solution = solution_of(result)
    shown = solution.model.displacements(result.solved.weights).reshape(
        solution.displacements.shape
    )
    away = np.linalg.norm(solution.displacements - shown, axis=2)
    np.testing.assert_allclose(away, solution.distances, atol=1e-12)


def test_the_guard_against_noise_counts_by_the_size_of_the_face(exact: ShotResult) -> None:
    """A face three times as large, whose brows hardly move, in the same share of its size."""
    slight = shrunk(exact, 0.6)
    assert slight.model is not None
    displaced, weights = 0.05 * slight.displacements, 0.05 * slight.weights.weights
    large = slight.model.mapped(lambda offsets: 3.0 * offsets)
    human, wrong, right = (
        brow_factor(
            weights, k * displaced, MotionModel(k * slight.rest, model, 3, True), BROWS, size=s
        )
        for k, model, s in ((1.0, slight.model, 1.0), (3.0, large, 1.0), (3.0, large, 3.0))
    )
    assert 1.0 < human < wrong
    assert right == pytest.approx(human, rel=1e-9)
