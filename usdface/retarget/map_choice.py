"""Choice of the space map: the one with which the rig's shapes explain the take's motion.

Candidates are the plain similarity and, for each kernel, the radial field that best predicts a
resting marker from all others. The take's motion decides between them
(`usdface.retarget.motion_evidence`); where it is no evidence, the error of predicting neutral
markers does.

Each marker in turn is left out and predicted by the map that the others give. For the radial
field this needs no new fit (Rippa 1999, "An algorithm for selecting a good value for the
parameter c in radial basis function interpolation"): with A the matrix of `fit_map`, smoothing
and constant included, and c its solution, the error at marker i is ``c_i / (A^-1)_ii``. This
holds for any value at marker i, so also where the similarity below the field is fitted anew
without it. Wide kernels and little smoothing are chosen between smooth faces, more smoothing where
markers are a little off their vertices.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from usdface.arrays import FloatArray
from usdface.numerics.rms import rms
from usdface.options import Kernel, MapOptions
from usdface.retarget.rbf import SpaceMap, carry, distances, fit_map, kernel_values, spacing

__all__ = ["MapChoice", "choose_map", "left_out_errors"]

# The grid that is searched; python -m benchmarks.stylised measures the choice.
RADII = (2.0, 3.0, 5.0, 8.0)
SMOOTHINGS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
# Of maps within this factor of the best, the one that bends least is taken. Set by hand;
# docs/constants.md.
_AS_GOOD = 1.05
# More points than this are a mesh, not markers: the time grows with their cube.
_MOST = 400


@dataclass(frozen=True, slots=True)
class MapChoice:
    """A space map's name, how well it predicts left-out markers and carries the take's motion.

    Attributes
    ----------
    name : str
    error : float [m]
        RMS distance on the character of a left-out marker to its vertex; NaN if not computed.
    similarity_error : float [m]
        The same for the map that does not bend.
    best : dict of str to float [m]
        The least error of each kernel.
    unexplained : dict of str to float
        Of each candidate the share of the take's displacements that shapes and head do not explain
        (RMS by RMS); empty if the take was no evidence.
    """

    name: str
    error: float = np.nan
    similarity_error: float = np.nan
    best: dict[str, float] | None = None
    unexplained: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the parts of the name: the kernel, its numbers, whose shapes are solved."""
        kernel, *rest = self.name.split(", ")
        shapes = "character"
        numbers: dict[str, Any] = {}
        for part in rest:
            word, _, number = part.partition(" ")
            if word in ("radius", "smoothing"):
                numbers[word] = float(number)
            elif kernel == "paper":
                numbers["form"], kernel = "paper", part
            else:
                shapes = "transferred" if part == "shapes transferred" else "performer"
        return {"kernel": kernel, **numbers, "shapes": shapes}


def choose_map(
    source: FloatArray,
    target: FloatArray,
    options: MapOptions,
    unexplained_share: Callable[[SpaceMap], float] | None = None,
) -> tuple[SpaceMap, MapChoice]:
    """Fit the space map that `options` ask for, choosing its settings where they say so.

    Parameters
    ----------
    source : (M, D) float64
        Neutral markers.
    target : (M, 3) float64 [m]
        Neutral feature points of the character.
    options : MapOptions
    unexplained_share : callable, optional
        Of a map, the share of the take's displacements that stays unexplained; NaN = unknown.

    Raises
    ------
    SolveError
        If there are too few markers, or they coincide.
    """
    if options.form == "paper":
        return fit_map(source, target, options), MapChoice(f"paper, {options.kernel}")
    fixed = fit_map(source, target, options)
    if not fixed.coefficients.any():
        return fixed, MapChoice("similarity", 0.0, 0.0, {})
    if options.choice == "fixed" or not 5 <= len(source) <= _MOST:
        return fixed, MapChoice(_name(options))
    candidates = _candidates(source, target, options)
    plain = candidates[0].error
    best: dict[str, float] = {c.settings.kernel: c.error for c in candidates if c.settings}
    space = {c.name: c.fitted(source, target, fixed) for c in candidates}
    # Where left and right are exchanged the best field is a mirror; no map between faces is.
    candidates = [c for c in candidates if c.settings is None or not _mirrors(space[c.name])]
    shares = {}
    if unexplained_share is not None:
        shares = {c.name: unexplained_share(space[c.name]) for c in candidates}
    if not shares or np.isnan(list(shares.values())).any():
        shares = {}
    if shares:
        least = min(shares.values())
        candidates = [c for c in candidates if shares[c.name] <= _AS_GOOD * least]
    least = min(c.error for c in candidates)
    chosen = min((c for c in candidates if c.error <= _AS_GOOD * least), key=lambda c: c.freedom)
    return space[chosen.name], MapChoice(chosen.name, chosen.error, plain, best, shares)


def _mirrors(space: SpaceMap) -> bool:
    """Return whether a map in space mirrors the surroundings of most markers."""
    derivative = space.derivative
    if derivative.shape[1] != 3:
        return False
    return bool(np.mean(np.linalg.det(derivative) < 0.0) > 0.5)


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A map: that of `settings`, or the similarity where they are None."""

    error: float
    freedom: float
    settings: MapOptions | None

    @property
    def name(self) -> str:
        return "similarity" if self.settings is None else _name(self.settings)

    def fitted(self, source: FloatArray, target: FloatArray, fixed: SpaceMap) -> SpaceMap:
        if self.settings is not None:
            return fit_map(source, target, self.settings)
        linear, offset = carry(source, target)
        return replace(fixed, coefficients=np.zeros_like(target), linear=linear, offset=offset)


def _candidates(source: FloatArray, target: FloatArray, options: MapOptions) -> list[_Candidate]:
    """Return the similarity, and of each kernel the map that best predicts left-out markers."""
    rest = _rest_without(source, target)
    result = [_Candidate(rms(np.linalg.norm(np.einsum("iid->id", rest), axis=1)), 0.0, None)]
    for kernel in get_args(Kernel):
        of_kernel = []
        for radius in RADII:
            errors, freedom = left_out_errors(source, rest, kernel, radius, SMOOTHINGS)
            away = rms(np.linalg.norm(errors, axis=1), axis=0).tolist()
            for error, free, smoothing in zip(away, freedom, SMOOTHINGS, strict=True):
                settings = replace(options, kernel=kernel, radius=radius, smoothing=smoothing)
                of_kernel.append(_Candidate(error, float(free), settings))
        least = min(candidate.error for candidate in of_kernel)
        good = [candidate for candidate in of_kernel if candidate.error <= _AS_GOOD * least]
        result.append(min(good, key=lambda candidate: candidate.freedom))
    return result


def left_out_errors(
    source: FloatArray,
    rest: FloatArray,
    kernel: Kernel,
    radius: float,
    smoothings: tuple[float, ...],
) -> tuple[FloatArray, FloatArray]:
    """Predict each marker from the others, for some smoothings at once.

    Parameters
    ----------
    source : (M, D) float64
        Neutral markers.
    rest : (M, M, 3) float64 [m]
        ``rest[i, j]`` is the residual at marker j of the similarity fitted without marker i.
    kernel, radius, smoothings
        As in `MapOptions`; the radius counts spacings of all markers.

    Returns
    -------
    errors : (M, 3, len(smoothings)) float64 [m]
        True place less prediction.
    freedom : (len(smoothings),) float64
        Effective degrees of freedom of the field: the trace of its smoother.
    """
    count, reach = len(source), radius * spacing(source)
    sign = -1.0 / reach if kernel == "multiquadric" else 1.0
    matrix = sign * kernel_values(kernel, distances(source, source), reach)
    # On vectors that sum to zero the bordered system is an ordinary one, and its inverse
    # for every smoothing comes from one eigen-decomposition.
    free = np.linalg.svd(np.ones((1, count)))[2][1:].T
    values, vectors = np.linalg.eigh(free.T @ matrix @ free)
    vectors = free @ vectors
    inverse = 1.0 / (np.maximum(values, 0.0)[:, None] + np.array(smoothings))
    along = np.einsum("jk,ijd->idk", vectors, rest, optimize=True)
    solved = (along * vectors[:, None]) @ inverse
    errors = solved / (vectors**2 @ inverse)[:, None]
    return errors, count - 1.0 - np.array(smoothings) * inverse.sum(axis=0)


def _rest_without(source: FloatArray, target: FloatArray) -> FloatArray:
    """Return the residual at marker j of the similarity fitted without marker i: (M, M, 3)."""
    rest = np.empty((len(source), *target.shape))
    for i in range(len(source)):
        linear, offset = carry(np.delete(source, i, axis=0), np.delete(target, i, axis=0))
        rest[i] = target - (source @ linear + offset)
    return rest


def _name(options: MapOptions) -> str:
    return f"{options.kernel}, radius {options.radius:g}, smoothing {options.smoothing:g}"
