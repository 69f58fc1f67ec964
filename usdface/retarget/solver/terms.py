"""The terms that the solve adds to the sum of squares, each an expectation of the weights.

A term is the negative logarithm of a prior times the error variance of the markers: 0 where markers
do not err. A new one is a class here in `TERMS` and its settings in `usdface.options.SolveOptions`
(name, default, range, schema row), which it reads from `held.options`: solve, confidence, USD and
binding files take both from there, and the tests print the missing row of the schema.
docs/solver_terms.md has an example.
"""

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.symmetry import gaze_pairs, symmetric_pairs
from usdface.retarget.solver.covariance import inverse_bands
from usdface.retarget.solver.curvature import curvature_bands

if TYPE_CHECKING:
    from usdface.retarget.solver.regularisation import Regularisation

__all__ = [
    "TERMS",
    "Gaze",
    "Restraint",
    "Ridge",
    "Smoothness",
    "SolverTerm",
    "Sparsity",
    "Symmetry",
    "roughness",
]

# Upper bound of the misfit in `Restraint`, as a share of the face's size, 0.2 mm on the ICT face: a
# larger one is not imitated by more small weights. Without it weights of performers whose shapes
# have other directions (python -m benchmarks.solve) shrink by a tenth.
_MOST_MISFIT = 0.003


class SolverTerm:
    """A function of the weights w of a take that is added to half the sum of squares.

    It is ``sum_t (w_t' Q w_t / 2 - q' w_t) + tr(M^-1 W' K W) / 2`` with Q of `matrix`, q of `pull`,
    K of `bands` and M the covariance that was learned from the take, the unit matrix if none was.
    A term overrides the parts that it has.

    Attributes
    ----------
    by_shape : bool
        True if it depends on the shapes' names: it is left out of the wider problem for a first
        guess (`usdface.retarget.solver.nonlinear_solve.first_guess`).
    """

    by_shape: ClassVar[bool] = False

    def matrix(self, held: "Regularisation", size: int) -> FloatArray | None:
        """Return Q, (S, S) [m^2], symmetric positive semi-definite, for `size` shapes."""
        return None

    def pull(self, held: "Regularisation", size: int) -> FloatArray | None:
        """Return q, (S,) [m^2]."""
        return None

    def bands(self, held: "Regularisation", times: FloatArray) -> FloatArray | None:
        """Return K, (3, F) [m^2], upper banded storage, for frames at `times` (F,) [s]."""
        return None

    def value(self, held: "Regularisation", weights: FloatArray) -> FloatArray:
        """Return the cost of weights (F, S) in each frame, without the bands: (F,) [m^2]."""
        size = weights.shape[1]
        matrix, pull = self.matrix(held, size), self.pull(held, size)
        value: FloatArray = np.zeros(len(weights))
        if matrix is not None:
            value += 0.5 * ((weights @ matrix) * weights).sum(axis=1)
        if pull is not None:
            value -= weights @ pull
        return value


class Ridge(SolverTerm):
    """Weights are about `spread` large: ``e / spread^2 * |w|^2 / 2``.

    A covariance learned from the take already has the size of the weights; the ridge is then of the
    misfit alone, which does not average out over frames.
    """

    def _factor(self, held: "Regularisation") -> float:
        variance = held.variance if held.covariance is None else held.lasting_variance
        return variance / held.options.spread**2

    def matrix(self, held: "Regularisation", size: int) -> FloatArray | None:  # noqa: D102
        return self._factor(held) * np.eye(size)

    def value(self, held: "Regularisation", weights: FloatArray) -> FloatArray:  # noqa: D102
        return np.asarray(0.5 * self._factor(held) * (weights**2).sum(axis=1))


class Sparsity(SolverTerm):
    """Weights are exponential with mean 1 / `sparsity`: ``e * sparsity * |w|_1``.

    Linear, since the weights' sum is their L1 norm where they are 0 or more, as by default.
    """

    def pull(self, held: "Regularisation", size: int) -> FloatArray | None:  # noqa: D102
        strength = held.variance * held.options.sparsity
        return np.full(size, -strength) if strength else None


class Restraint(SolverTerm):
    """Shapes that explain only misfit rest: ``restraint * misfit * size * |w|_1``.

    A performer whose shapes have other directions than the character's is imitated by small
    spurious weights, in proportion to the misfit. They are driven to 0; shapes that move much lose
    little. `restraint` times the face's size is the motion that counts as small.
    """

    def pull(self, held: "Regularisation", size: int) -> FloatArray | None:  # noqa: D102
        misfit = min(held.misfit, _MOST_MISFIT * held.size)
        strength = held.options.restraint * misfit * held.size
        return np.full(size, -strength) if strength else None


class Symmetry(SolverTerm):
    """Left and right differ by about 1 / sqrt(`symmetry`): ``e * symmetry * (w_l - w_r)^2 / 2``.

    The pairs are those of the shapes' names (`usdface.face.symmetry`).
    """

    by_shape = True

    def matrix(self, held: "Regularisation", size: int) -> FloatArray | None:  # noqa: D102
        strength = held.variance * held.options.symmetry
        return strength * _differences(symmetric_pairs(held.names), size) if strength else None


class Gaze(SolverTerm):
    """Both eyes look the same way: ``e / vergence^2 * (w_l - w_r)^2 / 2``.

    The pairs turn both eyes to one side, up or down (`usdface.face.symmetry.gaze_pairs`): eyes move
    together (E. Hering, "Die Lehre vom binocularen Sehen", 1868: equal innervation). Without it a
    frown, which draws the skin around the eyes inwards, is taken for eyes that cross.
    """

    by_shape = True

    def matrix(self, held: "Regularisation", size: int) -> FloatArray | None:  # noqa: D102
        pairs = gaze_pairs(held.names)
        if not len(pairs):
            return None
        return held.variance / held.options.vergence**2 * _differences(pairs, size)


class Smoothness(SolverTerm):
    """Second derivatives are white with power `agility`, or the process is the learned one.

    ``v * smoothness / agility * integral |w''|^2 dt / 2`` with v the variance of the noise alone,
    since misfit is slow; where the covariance was learned, v * smoothness times the inverse
    covariance over time of `usdface.retarget.solver.covariance`.
    """

    def bands(self, held: "Regularisation", times: FloatArray) -> FloatArray | None:  # noqa: D102
        options = held.options
        if held.covariance is not None:
            learned = inverse_bands(times, options.pace)
            return np.asarray(held.noise**2 * options.smoothness * learned)
        stiffness = held.noise**2 * options.smoothness / options.agility
        return np.asarray(curvature_bands(times) * stiffness)


TERMS: tuple[SolverTerm, ...] = (Ridge(), Sparsity(), Restraint(), Symmetry(), Gaze(), Smoothness())


def _differences(pairs: IntArray, size: int) -> FloatArray:
    """Return D, (S, S), of which w' D w is the sum of (w_l - w_r)^2 over pairs (P, 2)."""
    differences = np.zeros((len(pairs), size))
    differences[np.arange(len(pairs)), pairs[:, 0]] = 1.0
    differences[np.arange(len(pairs)), pairs[:, 1]] = -1.0
    return np.asarray(differences.T @ differences)


def roughness(bands: FloatArray, weights: FloatArray) -> float:
    """Return ``tr(W' K W)`` for K in upper banded storage (3, F) and weights W (F, S)."""
    two, one, none = bands
    return float(
        (none[:, None] * weights**2).sum()
        + 2.0
        * (
            (one[1:, None] * weights[1:] * weights[:-1]).sum()
            + (two[2:, None] * weights[2:] * weights[:-2]).sum()
        )
    )
