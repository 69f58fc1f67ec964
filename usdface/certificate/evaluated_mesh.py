"""One mesh as a program evaluates it."""

from collections.abc import Callable
from dataclasses import dataclass

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.linear_morph import LinearMorph
from usdface.certificate.stored_steps import StoredSteps

__all__ = ["EvaluatedMesh"]


@dataclass(frozen=True, eq=False, slots=True)
class EvaluatedMesh:
    """One mesh as a program evaluates it at F moments.

    Attributes
    ----------
    name : str
    shapes : tuple of str, length S
    weights : (F, S) float64
    points_at : function from frames (f,) to (f, N, 3) float64 [m]
    normals_at : function from frames (f,) to (f, N, 3) unit vectors, or None
    linear_morph : function from frames (f,) to LinearMorph or None
        Of f moments, from the program's own evaluation of each shape and joint; None where more
        moves points.
    steps : StoredSteps or None
        Where it is stored as whole numbers.
    requested : EvaluatedMesh or None
        With the same vertices, as a request changes it; None where none does.
    """

    name: str
    shapes: tuple[str, ...]
    weights: FloatArray
    points_at: Callable[[IntArray], FloatArray]
    normals_at: Callable[[IntArray], FloatArray | None]
    linear_morph: Callable[[IntArray], LinearMorph | None] = lambda frames: None
    steps: StoredSteps | None = None
    requested: "EvaluatedMesh | None" = None
