"""Known weights through the views of a camera."""

from dataclasses import replace

import numpy as np
import pytest
from curved_world import make_curved_world
from filmed import COUNT, FACE, MESH, PLACES, VERTICES, WORLD, turning

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.dot_skin import dot_skin
from usdface.geometry.rigid_fit import Pose
from usdface.options import SolveOptions
from usdface.retarget.film.projected_weights import solve_projected_weights
from usdface.retarget.film.views import Views
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solve_problem import SolveProblem
from usdface.setup.binding import Binding
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup

SETUP = RetargetSetup(
    Binding(WORLD.take.names, PLACES),
    neutral=(0, 0),
    head="solve",
    solve=SolveOptions(iterations=3000, tolerance=1e-9),
)
STILL = Pose(np.tile(np.eye(3), (COUNT, 1, 1)), np.zeros((COUNT, 3)))


def identity() -> SpaceMap:
    flat = np.eye(3)[:2]
    offset = np.array([0.0, 0.0, 0.0])
    return SpaceMap(FACE[:, :2], np.zeros_like(FACE), flat, offset, "gaussian", 1.0, local=True)


def solve(
    degrees: float,
    model: BlendShapeEvaluator = VERTICES.marker_evaluator,
    weights: FloatArray = WORLD.weights,
    names: tuple[str, ...] = MESH.shape_names,
    hidden: bool = False,
    lost: slice = slice(0),
    noise: float = 0.0,
    **settings: object,
) -> PoseAndWeights:
    slopes = np.repeat(turning(degrees).rotations[:, None, :2], len(FACE), axis=1)
    views = Views(WORLD.take.names, slopes, np.ones((COUNT, len(FACE))))
    positions = FACE[:, :2] + views.projected(model.displacements(weights)).reshape(COUNT, -1, 2)
    positions = positions + noise * np.random.default_rng(2).normal(size=positions.shape)
    if hidden:
        positions[10:30, 2] = np.nan
    positions[lost] = np.nan
    setup = replace(SETUP, **settings)
    problem = SolveProblem(
        WORLD.take.times, positions, FACE, model, identity(), STILL, setup, names
    )
    return solve_projected_weights(problem, views)


@pytest.mark.parametrize("hidden", [False, True])
def test_known_weights_come_back(hidden: bool) -> None:
    found = solve(20.0, hidden=hidden)
    np.testing.assert_allclose(found.weights, WORLD.weights, atol=2e-3)
    assert np.isnan(found.displaced[10:30, 2]).all() == hidden
    assert found.regularisation.misfit < 1e-6


def test_frames_that_show_nothing_follow_their_neighbours_but_for_pins() -> None:
    pins = (Pin("jawOpen", np.array([21]), np.array([0.9])),)
    whole, gap = solve(20.0).weights, slice(20, 23)
    for own in ((), pins):
        found = solve(20.0, lost=gap, pins=own).weights
        expected = np.linspace(whole[19], whole[23], 5)[1:4]
        column = MESH.shape_names.index("jawOpen")
        if own:
            assert found[21, column] == pytest.approx(0.9, abs=1e-9)
            expected, found = (np.delete(w, column, axis=1) for w in (expected, found))
        np.testing.assert_allclose(found[gap], expected, atol=0.02)


def test_displacements_come_back_in_head_space() -> None:
    found = solve(20.0)
    moved = VERTICES.marker_evaluator.displacements(WORLD.weights).reshape(COUNT, -1, 3)
    np.testing.assert_allclose(found.displaced, moved, atol=2e-5)


def forward_only() -> BlendShapeEvaluator:
    """One shape that moves the lips straight forwards, and the others."""
    offsets = np.array(VERTICES.marker_evaluator.offsets)
    forward = np.zeros((len(FACE), 3))
    forward[np.argsort(FACE[:, 1])[:4], 2] = 0.01
    return BlendShapeEvaluator(np.vstack([offsets, forward.ravel()]))


def test_only_a_head_that_looks_aside_shows_how_far_lips_come_forward() -> None:
    model = forward_only()
    course = 0.5 - 0.5 * np.cos(np.linspace(0.0, 6.0, COUNT))[:, None]
    weights = np.hstack([WORLD.weights, course])
    names = (*MESH.shape_names, "forward")
    aside, frontal = (
        solve(degrees, model, weights, names, noise=1e-5).weights[:, -1] for degrees in (30.0, 0.0)
    )
    turned = np.abs(turning(30.0).rotations[:, 0, 2]) > 0.2
    np.testing.assert_allclose(aside[turned], course[turned, 0], atol=0.05)
    assert np.abs(frontal).max() < 0.05


def test_shapes_with_inbetweens_and_combinations_come_back() -> None:
    world = make_curved_world(head_moves=False)
    mesh = world.rig.meshes[0]
    model = dot_skin(mesh, PLACES, np.full(len(PLACES), np.nan)).marker_evaluator
    assert not model.linear
    found = solve(20.0, model, np.array(world.weights), mesh.shape_names)
    assert np.sqrt(np.mean((found.weights - world.weights) ** 2)) < 0.01


def test_pins_hold() -> None:
    pins = (Pin("jawOpen", np.array([12, 13]), np.array([0.9, 0.85])),)
    found = solve(20.0, pins=pins)
    column = MESH.shape_names.index("jawOpen")
    np.testing.assert_allclose(found.weights[[12, 13], column], [0.9, 0.85], atol=1e-9)
