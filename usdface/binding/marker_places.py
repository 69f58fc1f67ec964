"""Optimal vertices for new markers of a capture: greedy D-optimal design."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import BoolArray, IntArray, freeze
from usdface.binding.face_surface import FaceSurface, face_surface
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.place_descriptions import place_descriptions
from usdface.geometry.marker_spread import rms_radius
from usdface.options import SolveOptions
from usdface.retarget.confidence import Confidence, confidence_of
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solver.regularisation import Regularisation
from usdface.rigs import Mesh
from usdface.setup.binding import Binding

__all__ = ["FreePlaces", "MarkerPlaces", "free_places", "marker_places"]

# Vertices of the surface that are examined, and of these tried, of more every n-th: bounds memory
# and time.
_EXAMINED, _TRIED = 20_000, 2000
# Trying a vertex takes work with the square of the number of shapes: with many shapes fewer are
# tried. So much work is some seconds; below the least number of vertices there is no choice.
_WORK, _LEAST_TRIED = 1_000_000_000, 100
# Nearest vertices of which one may face a vertex: bounds memory and time on dense meshes.
_NEIGHBOURS = 64
# A place is useful where some shape moves it by this share of its largest offset: the neck follows
# the jaw, too. Set by hand.
_SHOWS = 0.5
# Distance between two markers, and from a marker to a surface that faces it, as lips do [share of
# the face's size, the RMS radius of the useful surface; ICT: 6 and 3 mm]. Set by
# hand.
_APART, _FACING = 0.1, 0.05
# Frame rate of the capture that the design is for [Hz].
_RATE = 30.0
# Misfit of another face than the rig's, as on real takes, on a human face [m].
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
        freeze(self, "vertices", dtype=np.int64)


@dataclass(frozen=True, eq=False, slots=True)
class MarkerPlaces:
    """Places for new markers, the best first.

    Attributes
    ----------
    vertices : (K,) int64
    where : tuple of str, length K
        Descriptions, such as "left cheek, 14 mm from marker m7".
    undetermined_before : tuple of str
        Shapes that the present markers do not determine.
    undetermined : tuple of tuple of str, length K
        Shapes still undetermined with the first 1, 2, ... new markers.
    """

    vertices: IntArray
    where: tuple[str, ...]
    undetermined_before: tuple[str, ...]
    undetermined: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        freeze(self, "vertices", dtype=np.int64)

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
    useful = np.flatnonzero(surface.level & _shown(surface)[surface.vertices])
    if not len(useful):
        return FreePlaces(np.zeros(0, np.int64), 0.0)
    size = rms_radius(surface.points[useful])
    examined = _decimated(np.arange(len(surface.points)), _EXAMINED)
    free = np.intersect1d(useful, examined[~_faced(surface, examined, _FACING * size)])
    if len(bound):
        away = cKDTree(mesh.points[bound]).query(surface.points[free])[0]
        free = free[away >= _APART * size]
    tried = max(_LEAST_TRIED, min(_TRIED, _WORK // len(mesh.shapes) ** 2))
    return FreePlaces(_decimated(surface.vertices[free], tried), _APART * size)


def _decimated(values: IntArray, most: int) -> IntArray:
    """Return every n-th value, so that there are no more than `most`."""
    return values[:: max(1, -(-len(values) // most))]


def _shown(surface: FaceSurface) -> BoolArray:
    """Return (V,) where some shape moves the mesh by much of its largest offset."""
    shown = np.zeros(len(surface.torn), dtype=bool)
    for shape in surface.mesh.shapes:
        length = np.where(surface.torn[shape.indices], 0.0, np.linalg.norm(shape.offsets, axis=1))
        shown[shape.indices[length >= max(_SHOWS * length.max(initial=0.0), 1e-12)]] = True
    return shown


def _faced(surface: FaceSurface, examined: IntArray, reach: float) -> BoolArray:
    """Return (K,) which of the examined vertices another one faces within `reach` [m]."""
    points, normals = surface.points[examined], surface.normals[examined]
    count = min(_NEIGHBOURS, len(points))
    _, near = cKDTree(points).query(points, k=[*range(1, count + 1)], distance_upper_bound=reach)
    faced = np.zeros(len(points), dtype=bool)
    for other in near.T:
        a = np.flatnonzero(other < len(points))
        b = other[a]
        between = points[b] - points[a]
        ahead = (normals[a] * between).sum(axis=1) > 0.0
        back = (normals[b] * between).sum(axis=1) < 0.0
        turned = (normals[a] * normals[b]).sum(axis=1) < 0.0
        faced[a[ahead & back & turned]] = True
    return faced


def marker_places(mesh: Mesh, binding: Binding, *, count: int, noise: float) -> MarkerPlaces:
    """Choose the best places for the next markers among `free_places`: greedy D-optimal design.

    Parameters
    ----------
    mesh : Mesh
    binding : Binding
        Markers that are there already; none for a first set.
    count : int
        New markers.
    noise : float [m]
        Standard deviation of a marker coordinate on a human face.

    Raises
    ------
    InputError
        If `count` is less than 1 or more than there is room for, or its
        blend shapes move no visible surface.
    """
    face = BoundFace(mesh, binding.markers, binding.points)
    human = face.at_human_size().mesh
    free = free_places(human, binding.points)
    places = np.concatenate([binding.points, free.vertices])
    present = len(binding.points)
    shown = _confidence(
        human, places, bound=present, wanted=max(count, 0), noise=noise, room=free.room
    )
    if not 1 <= count <= len(shown.places):
        # How many there is room for is known only where more were searched.
        expected = f"1 to {len(shown.places)}" if count > 0 else "1 or more"
        raise InputError(f"{count} new markers are requested; expected {expected}", "SETTING_WRONG")
    vertices = places[shown.places]
    bound = np.concatenate([binding.points, vertices])
    undetermined = [
        _confidence(human, bound, bound=present + k, wanted=0, noise=noise).undetermined
        for k in range(count + 1)
    ]
    named = [tuple(mesh.shape_names[s] for s in shapes.tolist()) for shapes in undetermined]
    where = place_descriptions(face, vertices)
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
        MotionModel.linear(mesh.points[places], mesh.offsets_at(places), 3, moving_head=True),
        np.arange(bound),
        1.0 / _RATE,
        Regularisation(noise, _MISFIT, SolveOptions()),
        wanted,
        room=room,
    )
