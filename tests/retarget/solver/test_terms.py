"""What each term says of weights is one thing, whichever part is asked; a newcomer's is enough."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bands import dense

from usdface.options import SolveOptions
from usdface.retarget.confidence import weight_deviations
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights
from usdface.retarget.solver.terms import (
    TERMS,
    Gaze,
    Restraint,
    Ridge,
    Smoothness,
    SolverTerm,
    Sparsity,
    Symmetry,
)

GUIDE = Path(__file__).parents[3] / "docs" / "solver_terms.md"
OPTIONS = SolveOptions(spread=0.5, agility=27.0, smoothness=2.0, sparsity=0.7, symmetry=30.0)
NAMES = ("smileLeft", "jawOpen", "smileRight", "puff")
RNG = np.random.default_rng(5)
BASIS = 0.01 * RNG.normal(size=(4, 24))
NORMAL = BASIS @ BASIS.T
STEP = 1 / 30


def guide() -> dict[str, object]:
    """Everything that the examples of docs/solver_terms.md define, run from the top."""
    code = re.findall(r"^```python\n(.*?)^```$", GUIDE.read_text(encoding="utf-8"), re.M | re.S)
    names: dict[str, object] = {}
    exec("\n".join(code), names)
    return names


class Sluggish(SolverTerm):
    """Weights change little from one frame to the next: a term that joins frames."""

    strength = 30.0

    def bands(self, held: Regularisation, times: np.ndarray) -> np.ndarray:
        bands = np.zeros((3, len(times)))
        bands[2] = 2.0
        bands[2, [0, -1]] = 1.0
        bands[1, 1:] = -1.0
        return held.noise**2 * self.strength * bands


@pytest.mark.parametrize("term", [*TERMS, guide()["Restless"]()], ids=lambda t: type(t).__name__)
def test_the_value_has_the_slope_of_matrix_and_pull(term: SolverTerm) -> None:
    held = Regularisation(0.3, 0.1, OPTIONS, NAMES, size=50.0, terms=(term,))
    weights, step = RNG.random((5, 4)), 1e-6 * np.eye(4)
    slope = np.stack([held.value(weights + h) - held.value(weights - h) for h in step], axis=1)
    np.testing.assert_allclose(slope / 2e-6, held.gradient(weights), atol=1e-7)


def test_the_terms_are_those_of_the_equation() -> None:
    held = Regularisation(0.3, 0.1, OPTIONS, NAMES)
    error = 0.3**2 + 2 * 0.1**2
    w, times = np.array([[0.2, 0.5, 0.6, 0.0]]), np.arange(5.0)
    assert Ridge().value(held, w) == pytest.approx(error * (w**2).sum() / 0.5**2 / 2)
    assert Sparsity().value(held, w) == pytest.approx(error * 0.7 * w.sum())
    assert Symmetry().value(held, w) == pytest.approx(error * 30 * 0.4**2 / 2)
    assert Smoothness().bands(held, times)[2, 2] == pytest.approx(6 * 0.3**2 * 2 / 27)


def test_eyes_that_look_apart_cost_what_the_equation_says() -> None:
    names = ("eyeLookInLeft", "jawOpen", "eyeLookOutRight", "eyeLookInRight")
    held = Regularisation(0.3, 0.1, replace(OPTIONS, vergence=0.1), names)
    w = np.array([[0.9, 0.5, 0.2, 0.9]])
    assert Gaze().value(held, w) == pytest.approx(held.variance / 0.1**2 * 0.7**2 / 2)
    assert Gaze().matrix(replace(held, names=NAMES), 4) is None


def test_an_eye_that_no_marker_shows_looks_where_the_other_looks() -> None:
    names = ("eyeLookInLeft", "eyeLookOutRight")
    normal, truth = np.diag([1e-4, 0.0]), np.array([[0.6, 0.0]])
    for vergence, other in ((1e-4, 0.6), (1e6, 0.0)):
        options = SolveOptions(spread=1e3, vergence=vergence, iterations=5000, tolerance=1e-12)
        held = Regularisation(1e-4, 0.0, options, names)
        found = solve_weights(normal, truth @ normal, np.zeros(1), held).weights
        np.testing.assert_allclose(found, [[0.6, other]], atol=1e-3)


def test_restraint_is_of_the_misfit_and_the_faces_size() -> None:
    held = Regularisation(3e-4, 1e-4, replace(OPTIONS, restraint=0.05), size=0.06)
    w = np.array([[0.2, 0.5, 0.6, 0.0]])
    assert Restraint().value(held, w) == pytest.approx(0.05 * 1e-4 * 0.06 * w.sum())
    noiseless = replace(held, noise=0.0)
    assert Restraint().value(noiseless, w) == Restraint().value(held, w)


def test_more_misfit_than_a_share_of_the_face_restrains_no_more() -> None:
    of = [Regularisation(0.0, misfit, OPTIONS, size=0.06) for misfit in (1e-4, 1e-3, 1e-2)]
    small, large, larger = (Restraint().pull(held, 4) for held in of)
    assert (small > large).all()  # pulls are negative
    np.testing.assert_array_equal(large, larger)


@pytest.mark.parametrize("changes", [{"misfit": 0.0}, {"size": 0.0}, {"restraint": 0.0}])
def test_without_misfit_size_or_the_setting_there_is_no_restraint(
    changes: dict[str, float],
) -> None:
    settings = {"misfit": 1e-4, "size": 0.06, "restraint": 0.05} | changes
    options = replace(OPTIONS, restraint=settings["restraint"])
    held = Regularisation(3e-4, settings["misfit"], options, size=settings["size"])
    assert Restraint().pull(held, 4) is None
    alone = replace(held, terms=(Restraint(),))
    assert not alone.pulled(np.zeros((1, 4))).any()


def test_restraint_takes_the_same_motion_off_every_weight_down_to_rest() -> None:
    """Soft thresholding, of shapes that share no motion; less misfit, less of it."""
    options = SolveOptions(spread=1e6, restraint=0.067, iterations=5000, tolerance=1e-12)
    basis = np.linalg.qr(RNG.normal(size=(24, 3)))[0].T * [[0.03], [0.03], [0.003]]
    normal, truth = basis @ basis.T, np.array([[4e-4, 0.9, 0.5]])
    for misfit in (1e-4, 1e-5, 0.0):
        held = Regularisation(0.0, misfit, options, size=0.06)
        found = solve_weights(normal, truth @ normal, np.zeros(1), held).weights
        lost = 0.067 * misfit * 0.06 / np.diag(normal)
        np.testing.assert_allclose(found, np.maximum(truth - lost, 0.0), atol=1e-6)


def test_a_newcomers_term_is_solved() -> None:
    held = guide()["held"]
    right = np.array([[0.3, 0.1, 0.5, 0.2]]) @ NORMAL
    found = solve_weights(NORMAL, right, np.zeros(1), held).weights
    error, own = held.variance, 1 / 0.05**2
    expected = NORMAL + error * (4 + own) * np.eye(4)
    np.testing.assert_allclose(found, np.linalg.solve(expected, (right + error * own * 0.1).T).T)


def test_a_newcomers_term_is_seen_by_confidence() -> None:
    held = replace(guide()["held"], noise=0.03)
    posterior = np.linalg.inv(NORMAL / held.variance + (4 + 1 / 0.05**2) * np.eye(4))
    np.testing.assert_allclose(
        weight_deviations(NORMAL, 0.0, held), np.sqrt(np.diag(posterior)), rtol=1e-9
    )
    without = weight_deviations(NORMAL, 0.0, replace(held, terms=TERMS))
    assert (without > 1.5 * weight_deviations(NORMAL, 0.0, held)).all()


def test_a_newcomers_term_that_joins_frames_is_solved_and_seen_by_confidence() -> None:
    """Beside the dense problem of a whole take and, in its middle, the dense posterior."""
    frames, noise = 61, 0.004
    options = SolveOptions(spread=1e3, iterations=5000, tolerance=1e-12)
    held = Regularisation(noise, 0.0, options, terms=(*TERMS, Sluggish()))
    times = STEP * np.arange(frames)
    truth = 0.5 + 0.3 * np.sin(np.outer(times, [2.0, 3.0, 4.0, 5.0]))
    right = truth @ NORMAL
    whole = np.kron(np.eye(frames), NORMAL + noise**2 / options.spread**2 * np.eye(4))
    whole += np.kron(dense(held.bands(times)), np.eye(4))
    found = solve_weights(NORMAL, right, times, held).weights
    np.testing.assert_allclose(
        found, np.linalg.solve(whole, right.ravel()).reshape(-1, 4), atol=1e-6
    )
    middle = slice(4 * (frames // 2), 4 * (frames // 2) + 4)
    variances = noise**2 * np.diag(np.linalg.inv(whole))[middle]
    np.testing.assert_allclose(weight_deviations(NORMAL, STEP, held), np.sqrt(variances), rtol=1e-3)
