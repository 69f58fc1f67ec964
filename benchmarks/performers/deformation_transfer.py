"""Deformation transfer: the blend shapes of one face on another neutral of the same topology.

R. Sumner and J. Popovic, "Deformation Transfer for Triangle Meshes" (SIGGRAPH 2004). The
deformation gradient of each triangle of the source is asked of the target's triangle, in the sense
of least squares weighted by area.
"""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from usdface.arrays import FloatArray, IntArray

__all__ = ["transfer"]

# Vertices that are held at the source's own offset: those that move least. Without any the
# translation would be free.
_HELD = 300


def transfer(
    source: FloatArray, target: FloatArray, triangles: IntArray, offsets: FloatArray
) -> FloatArray:
    """Carry blend shapes from one neutral to another.

    Parameters
    ----------
    source, target : (V, 3) float64 [m]
        Neutral points.
    triangles : (T, 3) int64
    offsets : (S, V, 3) float64 [m]
        Of the source's blend shapes.

    Returns
    -------
    (S, V, 3) float64 [m]
        Of the target's.
    """
    gradient = _gradient(target, triangles)
    size = np.linalg.norm(offsets, axis=2).max(axis=0)
    held = ~np.isin(np.arange(len(source)), triangles)
    held[np.argsort(size, kind="stable")[:_HELD]] = True
    weighted = sparse.diags(np.repeat(_areas(target, triangles), 3)) @ gradient
    normal = (gradient.T @ weighted).tocsc()
    factor, coupled = splu(normal[~held][:, ~held]), normal[~held][:, held]
    rest = np.linalg.inv(_edges(source, triangles))
    moved = offsets.copy()
    for shape in range(len(offsets)):
        deformed = _edges(source + offsets[shape], triangles)
        # (T, 3, 3): columns of `_edges` are vectors, so that the gradient is its transpose.
        gradients = (deformed @ rest - np.eye(3)).transpose(0, 2, 1)
        right = weighted.T @ gradients.reshape(-1, 3)
        moved[shape, ~held] = factor.solve(right[~held] - coupled @ offsets[shape, held])
    return moved


def _edges(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return two edges and the normal, scaled as in the paper, as columns: (T, 3, 3)."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.sqrt(np.linalg.norm(normal, axis=1))[:, None]
    return np.stack([b - a, c - a, normal], axis=2)


def _areas(points: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _gradient(points: FloatArray, triangles: IntArray) -> sparse.csr_matrix:
    """Return the operator from values at vertices to their gradient on each triangle: (3 T, V).

    Row 3 t + i is the derivative along axis i; the gradient lies in the triangle's plane.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    twice = (normal**2).sum(axis=1)[:, None]
    of_b, of_c = np.cross(c - a, normal) / twice, np.cross(normal, b - a) / twice
    values = np.stack([-of_b - of_c, of_b, of_c], axis=1)
    rows = np.broadcast_to(
        (3 * np.arange(len(triangles))[:, None] + np.arange(3))[:, None], values.shape
    )
    columns = np.broadcast_to(triangles[:, :, None], values.shape)
    shape = (3 * len(triangles), len(points))
    return sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape)
