"""Cost of a take's motion for given weights of its neutral: a convex function of them."""

from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray
from usdface.retarget.solver.bounded_least_squares import solve_bounded

__all__ = ["NeutralCost"]

# Expected size of weights (`SolveOptions.spread`) and, relative to it, their L1 penalty.
_SPREAD = 0.5
_SPARSITY = 1.0
# Solved to far less than is saved, so that the order of markers decides nothing.
_EXACT = {"maxiter": 300, "ftol": 1e-13, "gtol": 1e-8}


@dataclass(frozen=True, eq=False, slots=True)
class NeutralCost:
    """Cost of W windows of a take, each with its best weights in [0, 1], in units of their error.

    Attributes
    ----------
    moved : (W, N) float64 [1]
        Displacements from the neutral.
    offsets : (P, N) float64 [1]
        Of the blend shapes.
    shares : (W,) float64
        Of the windows in the mean; their sum is 1.
    """

    moved: FloatArray
    offsets: FloatArray
    shares: FloatArray
    _normal: FloatArray = field(init=False)
    _right: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_normal", self.offsets @ self.offsets.T)
        right = self.moved @ self.offsets.T - _SPARSITY / _SPREAD
        object.__setattr__(self, "_right", right)

    def mean(self, neutral: FloatArray) -> float:
        """Return the mean cost for neutral weights (P,)."""
        return float(self._of_windows(neutral)[0].sum())

    def unexplained(self, neutral: FloatArray) -> float:
        """Return the part of the mean cost at neutral weights (P,) that is not of weights."""
        left = self.moved + (neutral - self._weights(neutral)) @ self.offsets
        return 0.5 * float(self.shares @ (left**2).sum(axis=1))

    def minimised(self, start: FloatArray, penalty: FloatArray, largest: FloatArray) -> FloatArray:
        """Return the neutral weights (P,) in [0, largest] of the least mean cost with a penalty.

        Parameters
        ----------
        start, penalty, largest : (P,) float64
            `penalty` by weight (L1).
        """
        from scipy.optimize import minimize  # costs more to import than a solve needs

        def penalised(neutral: FloatArray) -> tuple[float, FloatArray]:
            costs, slope = self._of_windows(neutral)
            return float(costs.sum() + penalty @ neutral), slope + penalty

        bounds = [(0.0, each) for each in largest.tolist()]
        start = np.minimum(start, largest)
        found = minimize(
            penalised, start, jac=True, method="L-BFGS-B", bounds=bounds, options=_EXACT
        )
        return np.asarray(found.x)

    def needed_in(self, neutral: FloatArray) -> FloatArray:
        """Return the windows that need each weight, by those in which the face moves: (P,).

        Both are effective numbers (L. Kish, "Survey Sampling", 1965), by amplitude: of the root of
        the cost that the weight saves in each window, and of that of its displacements, less
        their error. Infinite for weights of 0.
        """
        beyond = ((self.moved**2).sum(axis=1) - self.moved.shape[1]).clip(0.0)
        moving = max(_effective_number(self.shares * beyond), 1.0)
        found, costs = np.full(len(neutral), np.inf), self._of_windows(neutral)[0]
        for shape in np.flatnonzero(neutral):
            without = np.where(np.arange(len(neutral)) == shape, 0.0, neutral)
            saved = (self._of_windows(without)[0] - costs).clip(0.0)
            found[shape] = _effective_number(saved) / moving
        return found

    def _of_windows(self, neutral: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the windows' parts of the mean cost (W,), and its gradient (P,)."""
        weights = self._weights(neutral)
        left = self.moved + (neutral - weights) @ self.offsets
        costs = 0.5 * (left**2).sum(axis=1) + 0.5 * (weights**2).sum(axis=1) / _SPREAD**2
        costs += _SPARSITY / _SPREAD * weights.sum(axis=1)
        return self.shares * costs, self.shares @ left @ self.offsets.T

    def _weights(self, neutral: FloatArray) -> FloatArray:
        """Return the best weights (W, P) of the windows."""
        normal = self._normal + np.eye(len(neutral)) / _SPREAD**2
        return solve_bounded(normal, self._right + neutral @ self._normal)


def _effective_number(costs: FloatArray) -> float:
    amplitudes = np.sqrt(costs)
    total = float(costs.sum())
    return float(amplitudes.sum()) ** 2 / total if total else 0.0
