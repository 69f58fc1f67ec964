"""Where markers on a face would tell most about its blend shapes: before a capture, or the next."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from usdface.binding.skin import Skin, skin_of
from usdface.errors import InputError
from usdface.options import SolveOptions
from usdface.retarget.confidence import Confidence, confidence_of
from usdface.retarget.regions import place_names
from usdface.retarget.regularisation import Regularisation
from usdface.rigs import Mesh
from usdface.setup import Binding
from usdface.takes import BoolArray, IntArray, frozen

__all__ = ["FreePlaces", "MarkerPlaces", "free_places", "marker_places"]

# Vertices of the skin that are looked at, and of these tried; more of them are thinned out evenly.
_LOOKED, _TRIED = 20_000, 2000
# To try a place takes work with the square of the number of shapes: of many fewer places are tried.
_WORK, _LEAST_TRIED = 1_000_000_000, 100
# So many neighbours of a place say whether skin faces it.
_NEIGHBOURS = 64
# A marker is worth its place where some shape does this share of the most that it does anywhere:
# the neck goes along with the jaw, too.
_SHOWS = 0.5
# Between two markers, and from a marker to skin that faces it, as lips do [share of the face's
# size, the RMS radius of such skin; ICT: 6 and 3 mm].
_APART, _FACING = 0.1, 0.05
_RATE = 30.0
# What another face than the rig's is off by, as on real takes [m].
_MISFIT = 5e-4


@dataclass(frozen=True, eq=False, slots=True)
class FreePlaces:
    """Where more markers could be glued.

    Attributes
    ----------
    vertices : (N,) int64
    room : float [m]
        How far two markers must be apart.
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
        In words.
    unseen_before : tuple of str
        Shapes that the present markers say little or nothing about.
    unseen : tuple of tuple of str, length K
        What remains of these with the first 1, 2, ... new markers.
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
    """Find the skin on which one more marker would be of use, thinned out.

    Cameras on the height of the face see it, some blend shape shows well there, and there is room
    for a marker: none is near, and no skin faces it as the other lip does.

    Parameters
    ----------
    mesh : Mesh
    bound : (M,) int64
        Vertices that have a marker.

    Raises
    ------
    InputError
        If the mesh has no skin.
    """
    skin = skin_of(mesh)
    useful = np.flatnonzero(skin.level & _shown(skin)[skin.vertices])
    if not len(useful):
        return FreePlaces(np.zeros(0, np.int64), 0.0)
    points = skin.points[useful]
    size = float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))
    looked = np.zeros(len(skin.points), dtype=bool)
    looked[_thinned(np.arange(len(looked)), _LOOKED)] = True
    free = np.intersect1d(useful, np.flatnonzero(looked)[~_faced(skin, looked, _FACING * size)])
    if len(bound):
        away = cKDTree(mesh.points[bound]).query(skin.points[free])[0]
        free = free[away >= _APART * size]
    tried = max(_LEAST_TRIED, min(_TRIED, _WORK // len(mesh.shapes) ** 2))
    return FreePlaces(_thinned(skin.vertices[free], tried), _APART * size)


def _thinned(values: IntArray, most: int) -> IntArray:
    """Return each n-th of some values, so that there are no more than `most`."""
    return values[:: max(1, -(-len(values) // most))]


def _shown(skin: Skin) -> BoolArray:
    """Return where on the mesh some shape does much of the most that it does: (V,)."""
    shown = np.zeros(len(skin.torn), dtype=bool)
    for shape in skin.mesh.shapes:
        size = np.where(skin.torn[shape.indices], 0.0, np.linalg.norm(shape.offsets, axis=1))
        shown[shape.indices[size >= max(_SHOWS * size.max(initial=0.0), 1e-12)]] = True
    return shown


def _faced(skin: Skin, looked: BoolArray, reach: float) -> BoolArray:
    """Return which of the places looked at have skin before them that looks back at them."""
    points, normals = skin.points[looked], skin.normals[looked]
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


def marker_places(mesh: Mesh, binding: Binding, count: int, noise: float) -> MarkerPlaces:
    """Find the best places for the next markers: greedy D-optimal, where `free_places` are.

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
        If `count` is less than 1 or more than there is room for, or the mesh has no skin.
    """
    free = free_places(mesh, binding.points)
    places = np.concatenate([binding.points, free.vertices])
    present = len(binding.points)
    shown = _confidence(mesh, places, present, max(count, 0), noise, free.room)
    if not 1 <= count <= len(shown.places):
        most = len(shown.places) if count > 0 else len(free.vertices)
        raise InputError(
            f"{count} new markers are asked for; expected 1 to {most}", "SETTING_WRONG"
        )
    vertices = places[shown.places]
    bound = np.concatenate([binding.points, vertices])
    unseen = [_confidence(mesh, bound, present + k, 0, noise).hidden for k in range(count + 1)]
    named = [tuple(mesh.shape_names[s] for s in hidden.tolist()) for hidden in unseen]
    where = place_names(mesh, vertices, binding)
    return MarkerPlaces(vertices, where, named[0], tuple(named[1:]))


def _confidence(
    mesh: Mesh, places: IntArray, bound: int, wanted: int, noise: float, room: float = 0.0
) -> Confidence:
    """Say how sure a solve with markers on the first `bound` places is."""
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
