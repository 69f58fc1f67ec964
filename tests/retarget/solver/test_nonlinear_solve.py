import numpy as np
import pytest
from curved_world import make_curved_world

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.options import SolveOptions
from usdface.retarget.solver.bounds import UNIT, Bounds
from usdface.retarget.solver.nonlinear_solve import NonlinearProblem, first_guess, solve_nonlinear
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights
from usdface.retarget.solver.temporal_solve import Iterate

RNG = np.random.default_rng(6)
WORLD = make_curved_world(head_moves=False)
MODEL, _ = evaluator_of(WORLD.rig.meshes[0].shapes, np.array(list(WORLD.points.values())))
TRUTH = WORLD.weights[:, MODEL.free]
SEEN = MODEL.displacements(WORLD.weights)
NO_HEAD = np.zeros((SEEN.shape[1], 0))


def solved(seen: FloatArray, noise: float = 0.0, bounds: Bounds = UNIT, **options) -> FloatArray:
    times = np.arange(len(seen)) / 30
    held = Regularisation(noise, 0.0, SolveOptions(**options))
    problem = NonlinearProblem(MODEL, NO_HEAD, seen, times, held)
    return solve_nonlinear(problem, first_guess(problem), bounds).weights


def test_bent_paths_and_combinations_are_solved_back() -> None:
    assert np.abs(solved(SEEN) - TRUTH).max() < 1e-3
    # As if they were straight the weights are far off.
    straight = MODEL.offsets[MODEL.free]
    times = np.arange(len(SEEN)) / 30
    normal, right = straight @ straight.T, SEEN @ straight.T
    exact = Regularisation(0.0, 0.0, SolveOptions())
    plain = solve_weights(normal, right, times, exact).weights
    assert np.abs(plain - TRUTH).max() > 0.05


@pytest.mark.parametrize("mode", ["take", "frame"])
def test_each_frame_alone(mode: str) -> None:
    """Poses that have nothing to do with each other, as a rig sheet."""
    poses = RNG.random((60, len(MODEL.free))) * (RNG.random((60, len(MODEL.free))) < 0.4)
    found = solved(MODEL.displacements(MODEL.complete(poses)), mode=mode)
    assert np.median(np.abs(found - poses).max(axis=1)) < 1e-5
    assert (np.abs(found - poses).max(axis=1) < 1e-3).mean() > 0.95


def test_under_noise_it_is_nearer_than_straight_and_smooth() -> None:
    noisy = SEEN + 2e-4 * RNG.standard_normal(SEEN.shape)
    ours = solved(noisy, noise=2e-4)
    alone = solved(noisy, noise=2e-4, mode="frame")
    straight = MODEL.offsets[MODEL.free]
    times = np.arange(len(SEEN)) / 30
    normal, right = straight @ straight.T, noisy @ straight.T
    plain = solve_weights(normal, right, times, Regularisation(2e-4, 0.0, SolveOptions())).weights

    def off(weights: FloatArray) -> float:
        return float(np.sqrt(np.mean((weights - TRUTH) ** 2)))

    assert off(ours) < 0.7 * off(plain)
    assert off(ours) < off(alone)


def test_bounds_are_kept_exactly() -> None:
    lower, upper = np.zeros(TRUTH.shape), np.ones(TRUTH.shape)
    lower[10, 0] = upper[10, 0] = 0.25
    found = solved(SEEN, bounds=Bounds(lower, upper))
    assert found[10, 0] == 0.25 and found.min() >= 0 and found.max() <= 1
    np.testing.assert_allclose(np.delete(found, 10, 0), np.delete(TRUTH, 10, 0), atol=1e-3)


def test_straight_shapes_have_the_linear_answer() -> None:
    names = ("smileLeft", "smileRight", "blinkLeft", "jawOpen", "puff", "blinkRight")
    shapes = 0.01 * RNG.normal(size=(6, 40))
    seen = RNG.random((20, 6)) @ shapes + 1e-3 * RNG.normal(size=(20, 40))
    times, rigid = np.arange(20) / 30, np.zeros((40, 0))
    options = SolveOptions(symmetry=40.0, sparsity=2.0)
    for noise in (0.0, 1e-3):
        held = Regularisation(noise, 0.0, options, names)
        normal, right = shapes @ shapes.T, seen @ shapes.T
        plain = solve_weights(normal, right, times, held).weights
        start = Iterate(np.full((20, 6), 0.5))
        model = BlendShapeEvaluator(shapes)
        problem = NonlinearProblem(model, rigid, seen, times, held)
        found = solve_nonlinear(problem, start, UNIT)
        np.testing.assert_allclose(found.weights, plain, atol=2e-4)
