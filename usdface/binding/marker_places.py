"""Optimal vertices for new markers of a capture: greedy D-optimal design."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import BoolArray, IntArray, frozen
from usdface.binding.face_surface import FaceSurface, face_surface
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.place_names import place_names
from usdface.geometry.marker_spread import rms_radius
from usdface.options import SolveOptions
from usdface.retarget.confidence import Confidence, confidence_of
from usdface.retarget.regularisation import Regularisation
from usdface.retarget_setup import Binding
from usdface.rigs import Mesh

__all__ = ["FreePlaces", "MarkerPlaces", "free_places", "marker_places"]

# Vertices that are tried, of more every n-th: bounds the time.
_TRIED = 2000
# A place is useful where some shape moves it by this share of its largest offset: the neck follows
# the jaw, too. Set by hand.
_SHOWS = 0.5
# Distance between two markers, and from a marker to a surface that faces it, as lips do [share of
# the face's size, the RMS radius of the useful surface; ICT: 6 and 3 mm]. Set by
# hand.
_APART, _FACING = 0.1, 0.05
# Frame rate of the capture that the design is for [Hz].
_RATE = 30.0
# Misfit of another face than the rig's, as on real takes [m].
_MISFIT = 5e-4


@dataclass(frozen=True, eq=False, slots=True)
class FreePlaces:
    """Vertices to which more markers can be glued.

    Attributes
    ----------
    vertices : (N,) int64
    room : float [m]
        Least distance between two markers.
    """

    vertices: IntArray
    room: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.int64))


@dataclass(frozen=True, eq=False, slots=True)
class MarkerPlaces:
    """Places for new markers, the best first.

    Attributes
    ----------
    vertices : (K,) int64
    where : tuple of str, length K
        Descriptions, such as "left cheek, 14 mm from marker m7".
    unseen_before : tuple of str
        Shapes that the present markers do not determine.
    unseen : tuple of tuple of str, length K
        Shapes still not determined with the first 1, 2, ... new markers.
    """

    vertices: IntArray
    where: tuple[str, ...]
    unseen_before: tuple[str, ...]
    unseen: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.int64))

    def binding(self, present: Binding) -> Binding:
        """Return the binding with the new markers, which are named after their places."""
        names = list(present.markers)
        for where in self.where:
            base = where.split(",")[0].split(" (")[0].replace(" ", "_")
            number = next(k for k in range(1, len(names) + 2) if f"{base}_{k}" not in names)
            names.append(f"{base}_{number}")
        points = np.concatenate([present.points, self.vertices])
        return replace(present, markers=tuple(names), points=points, confidence=None)


def free_places(mesh: Mesh, bound: IntArray) -> FreePlaces:
    """Find the vertices on which one more marker is useful, decimated.

    Visible from the height of the face, well moved by some blend shape, with room for a marker:
    none is near, and no surface faces it as the other lip does.

    Parameters
    ----------
    mesh : Mesh
    bound : (M,) int64
        Vertices that have a marker.

    Raises
    ------
    InputError
        If the blend shapes of the mesh move no visible surface.
    """
    surface = face_surface(mesh)
    useful = surface.level & _shown(mesh, surface)
    points = surface.points[useful]
    if not len(points):
        return FreePlaces(np.zeros(0, np.int64), 0.0)
    size = rms_radius(points)
    useful &= ~_faced(surface, _FACING * size)
    if len(bound):
        away = cKDTree(mesh.points[bound]).query(surface.points)[0]
        useful &= away >= _APART * size
    free = surface.vertices[useful]
    return FreePlaces(free[:: max(1, -(-len(free) // _TRIED))], _APART * size)


def _shown(mesh: Mesh, surface: FaceSurface) -> BoolArray:
    """Return (N,) where some shape moves the surface by much of its largest offset."""
    own = np.linalg.norm(surface.offsets, axis=2)
    most = [np.linalg.norm(s.offsets, axis=1).max(initial=0.0) for s in mesh.shapes]
    least = np.maximum(_SHOWS * np.array(most), 1e-12)[:, None]
    return np.asarray((own >= least).any(axis=0))


def _faced(surface: FaceSurface, reach: float) -> BoolArray:
    """Return (N,) which vertices have a surface within `reach` [m] that faces them."""
    a, b = cKDTree(surface.points).query_pairs(reach, output_type="ndarray").T
    between = surface.points[b] - surface.points[a]
    ahead = (surface.normals[a] * between).sum(axis=1) > 0.0
    back = (surface.normals[b] * between).sum(axis=1) < 0.0
    turned = (surface.normals[a] * surface.normals[b]).sum(axis=1) < 0.0
    faced = np.zeros(len(surface.points), dtype=bool)
    faced[np.concatenate([a, b])[np.tile(ahead & back & turned, 2)]] = True
    return faced


def marker_places(mesh: Mesh, binding: Binding, *, count: int, noise: float) -> MarkerPlaces:
    """Choose the best places for the next markers among `free_places`: greedy D-optimal design.

    Parameters
    ----------
    mesh : Mesh
    binding : Binding
        Markers that are there already; none for a first set.
    count : int
        How many to add.
    noise : float [m]
        Standard deviation of a marker coordinate.

    Raises
    ------
    InputError
        If `count` is less than 1 or more than there is room for, or its
        blend shapes move no visible surface.
    """
    free = free_places(mesh, binding.points)
    places = np.concatenate([binding.points, free.vertices])
    present = len(binding.points)
    shown = _confidence(
        mesh, places, bound=present, wanted=max(count, 0), noise=noise, room=free.room
    )
    if not 1 <= count <= len(shown.places):
        most = len(shown.places) if count > 0 else len(free.vertices)
        raise InputError(
            f"{count} new markers are asked for; expected 1 to {most}", "SETTING_WRONG"
        )
    vertices = places[shown.places]
    bound = np.concatenate([binding.points, vertices])
    unseen = [
        _confidence(mesh, bound, bound=present + k, wanted=0, noise=noise).hidden
        for k in range(count + 1)
    ]
    named = [tuple(mesh.shape_names[s] for s in hidden.tolist()) for hidden in unseen]
    where = place_names(BoundFace(mesh, binding.markers, binding.points), vertices)
    return MarkerPlaces(vertices, where, named[0], tuple(named[1:]))


def _confidence(
    mesh: Mesh,
    places: IntArray,
    *,
    bound: int,
    wanted: int,
    noise: float,
    room: float = 0.0,
) -> Confidence:
    """Return the confidence of a solve with markers on the first `bound` places."""
    return confidence_of(
        mesh.points[places],
        mesh.offsets_at(places),
        np.arange(bound),
        3,
        True,
        1.0 / _RATE,
        Regularisation(noise, _MISFIT, SolveOptions()),
        wanted,
        room=room,
    )
