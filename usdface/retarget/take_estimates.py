"""Estimates from a whole take, on which the solve of each frame depends."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.marker_spread import rms_radius
from usdface.options import HeadMode, SolveOptions
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solver.regularisation import Regularisation

__all__ = ["TakeEstimates"]


_NO_TOLERANCE = 1e-300


@dataclass(frozen=True, eq=False, slots=True)
class TakeEstimates:
    """The estimates of a solve that hold for all frames.

    Attributes
    ----------
    markers : tuple of str, length M
        Those that are used.
    neutral : (M, D) float64
        Where they rest, in take space.
    neutral_weights : mapping of str to float
        Blend shape weights that the neutral frames show, which `neutral` is without.
    rest : (M, 3) float64 [m]
        Where they rest on the character.
    model : BlendShapeEvaluator
        Of their displacements there, at the performer's size.
    space : SpaceMap
        Its start corrects the neutral.
    marker_maps : (M, D, 3) float64
        The linear maps that carry displacements over to the character.
    choice : MapChoice
    shifts : (M, 3) float64 [m]
        From the vertices that the markers are bound to.
    head : {"solve", "markers", "stabilised"}
    head_markers : tuple of str, length H
        Of `head` "markers".
    head_neutral : (H, D) float64
        Where they rest, in take space.
    noise, misfit : float [m]
        Of a coordinate of the typical marker, on the character.
    covariance : (S, S) float64 or None
        Of the weights in a frame [1].
    rounds : int
        Of head pose and occluded markers, until they settled.
    factors : (S,) float64 [1]
        On the weights, of brows that the solve shrank.
    errors : (M,) float64 [1] or None
        Of the markers, by those around them; None = alike.
    """

    markers: tuple[str, ...]
    neutral: FloatArray
    neutral_weights: Mapping[str, float]
    rest: FloatArray
    model: BlendShapeEvaluator
    space: SpaceMap
    marker_maps: FloatArray
    choice: MapChoice
    shifts: FloatArray
    head: HeadMode
    head_markers: tuple[str, ...]
    head_neutral: FloatArray
    noise: float
    misfit: float
    covariance: FloatArray | None
    rounds: int
    factors: FloatArray
    errors: FloatArray | None

    def regularisation(self, options: SolveOptions, names: tuple[str, ...]) -> Regularisation:
        """Return that of every piece of the take, solved without tolerance.

        With a tolerance the number of iterations would depend on the frames of the piece.

        Parameters
        ----------
        options : SolveOptions
        names : tuple of str
            The blend shapes.
        """
        return Regularisation(
            self.noise,
            self.misfit,
            replace(options, tolerance=_NO_TOLERANCE),
            tuple(names[shape] for shape in self.model.free),
            self.covariance,
            rms_radius(self.rest),
        )
