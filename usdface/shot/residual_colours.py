"""The residual of a solve as colours of the skin, for a viewport."""

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.face.residual_heat import heat_of_markers
from usdface.shot.shot import ShotResult

__all__ = ["residual_colours"]

# From small to large, linear light: the colours of the page of `usdface view`.
_RAMP = np.array([[0.3, 0.31, 0.33], [0.75, 0.6, 0.08], [0.85, 0.16, 0.02], [0.75, 0.0, 0.12]])
# The end of the ramp: the residual that one marker in fifty exceeds, at least this [m].
_QUANTILE, _LEAST = 0.98, 0.002


@checked
def residual_colours(result: ShotResult, frames: tuple[int, ...]) -> FloatArray:
    """Return the colour of each vertex of the bound mesh: grey = 0, red = 2 mm or more.

    Residuals spread along the skin from the markers, so that the lower lip does not show those of
    the upper one. The end of the colours is the residual that one marker in fifty exceeds, if
    that is more than 2 mm.

    Parameters
    ----------
    result : ShotResult
        Of a marker take.
    frames : tuple of int
        Frame indices of the take.

    Returns
    -------
    (frames, V, 3) float64
        Linear red, green, blue.

    Raises
    ------
    InputError
        If the take has weights only, or no such frame.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda").value
    >>> usdface.residual_colours(result, (72,)).shape == (1, len(result.shot.mesh.points), 3)
    True
    """
    solution = result.solution
    if solution is None:
        raise InputError("the take has weights only; residuals need markers", "TAKE_KIND_WRONG")
    count = len(solution.residual)
    for frame in frames:
        if not 0 <= frame < count:
            raise InputError(
                f"there is no frame {frame}; the take has frames 0 to {count - 1}",
                "FRAMES_OUTSIDE",
            )
    face = result.shot.face
    nearest, shares = heat_of_markers(face.mesh, face.vertices_of(solution.markers))
    seen = solution.distances[~np.isnan(solution.distances)]
    most = max(_LEAST, float(np.quantile(seen, _QUANTILE)) if len(seen) else 0.0)
    distances = np.nan_to_num(solution.distances[list(frames)])
    residual = np.einsum("fvk,vk->fv", distances[:, nearest], shares)
    return _ramp(residual / most)


def _ramp(shares: FloatArray) -> FloatArray:
    """Return the colours of shares (...): (..., 3)."""
    at = np.clip(shares, 0.0, 1.0) * (len(_RAMP) - 1)
    low = np.minimum(at.astype(np.int64), len(_RAMP) - 2)
    part = (at - low)[..., None]
    return np.asarray((1.0 - part) * _RAMP[low] + part * _RAMP[low + 1])
