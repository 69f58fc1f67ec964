"""Candidate vertices for markers, decimated and normalised."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.binding.face_surface import FaceSurface
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_modes import infinitesimal_motions

__all__ = ["LARGEST_WEIGHT", "CandidateVertices", "candidate_vertices"]

# The largest weight of a performer whose movements are stronger than the rig's. Set by hand; judge:
# `python benchmarks/binding.py`, whose performers reach 1.25; docs/constants.md lists them.
LARGEST_WEIGHT = 1.5
# Edge of the cells that even out the mesh before its centre and size are measured [share of the
# face's size]: longer than the edges of a face mesh, far shorter than the face.
_EVEN_CELL = 0.08
# A vertex counts by the skin around it, at most by a disc of this radius [share of the face's size;
# ICT: 1.8 mm]. Without areas finely meshed lids and lips attract markers, without a limit coarse
# skin does. Chosen on named takes: `python benchmarks/binding.py named`.
_DISC = 0.027
# By how much the middle of a cell is shifted, in its edges: of two points that mirror each other
# the left one is nearer. Far above rounding.
_BESIDE = np.array([1e-3, 0.0, 0.0])


@dataclass(frozen=True, eq=False, slots=True)
class CandidateVertices:
    """The vertices that a marker may be assigned to: a face surface, or a decimated part of it.

    Attributes
    ----------
    surface : FaceSurface
    indices : (N,) int64
        Into `surface.vertices`, rising.
    points : (N, 3) float64 [m]
        From the centre of the moving surface.
    centre : (3,) float64 [m]
    offsets : (S, N, 3) float64 [m]
        Offsets of the blend shapes at the largest weight of a strong performer.
    rigid_motions : (6, N, 3) float64
        Infinitesimal rigid motions of the face.
    areas : (N,) float64 [m²]
        Of the skin that each vertex stands for.
    size : float [m]
        RMS radius of the moving surface.
    """

    surface: FaceSurface
    indices: IntArray
    points: FloatArray
    centre: FloatArray
    offsets: FloatArray
    rigid_motions: FloatArray
    areas: FloatArray
    size: float


def candidate_vertices(
    surface: FaceSurface, cell: float = 0.0, keep: IntArray | None = None
) -> CandidateVertices:
    """Choose one vertex of the surface in each cell of a grid.

    Parameters
    ----------
    surface : FaceSurface
    cell : float
        Edge of a cell as a share of the face's size; 0 = all vertices.
    keep : (K,) int64, optional
        Indices into the surface that are candidates in any case.
    """
    moving = surface.points[surface.moving]
    # Evenly, or finely meshed lids and lips would be most of the face.
    even = moving[_decimated(moving, _EVEN_CELL * rms_radius(moving))]
    centre = even.mean(axis=0)
    size = rms_radius(even)
    indices = np.arange(len(surface.points))
    if cell:
        indices = _decimated(surface.points, cell * size)
    if keep is not None:
        indices = np.union1d(indices, keep)
    points = surface.points[indices] - centre
    return CandidateVertices(
        surface=surface,
        indices=indices,
        points=points,
        centre=centre,
        offsets=LARGEST_WEIGHT * surface.offsets_at(indices),
        rigid_motions=infinitesimal_motions(points),
        areas=np.minimum(surface.areas[indices], np.pi * (_DISC * size) ** 2),
        size=size,
    )


def _decimated(points: FloatArray, cell: float) -> IntArray:
    """Return the index of the point nearest to the middle of each cell.

    Cells lie around the middle of the points: wherever a face stands, and alike on both sides.
    Neither the order of the points nor, of two that mirror each other, their rounding decides.
    """
    places = (points - 0.5 * (points.min(axis=0) + points.max(axis=0))) / cell
    cells = np.rint(places)
    away = ((places - cells - _BESIDE) ** 2).sum(axis=1)
    nearest = np.argsort(away, kind="stable")
    _, first = np.unique(cells[nearest], axis=0, return_index=True)
    return np.sort(nearest[first])
