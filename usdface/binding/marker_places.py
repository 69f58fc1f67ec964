"""Where markers on a face would tell most about its blend shapes: before a capture, or the next."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.binding.skin import skin_of
from usdface.errors import InputError
from usdface.options import SolveOptions
from usdface.retarget.confidence import Confidence, confidence_of
from usdface.retarget.regions import place_names
from usdface.rigs import Mesh
from usdface.setup import Binding
from usdface.takes import IntArray, frozen

__all__ = ["MarkerPlaces", "marker_places"]

# Vertices of the skin that are tried; more of them are thinned out evenly.
_TRIED = 2000
_RATE = 30.0
# What another face than the rig's is off by, as on real takes [m].
_MISFIT = 5e-4


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


def marker_places(mesh: Mesh, binding: Binding, count: int, noise: float) -> MarkerPlaces:
    """Find the best places for the next markers: greedy D-optimal, on skin that can be seen.

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
        If `count` is less than 1 or more than the skin has vertices, or the mesh has no skin.
    """
    face = skin_of(mesh)
    skin = np.setdiff1d(face.vertices[face.moving], binding.points)
    free = skin[:: max(1, -(-len(skin) // _TRIED))]
    if not 1 <= count <= len(free):
        raise InputError(f"{count} new markers are asked for; expected 1 to {len(free)}")
    places = np.concatenate([binding.points, free])
    present = len(binding.points)
    shown = _confidence(mesh, places, present, count, noise)
    vertices = places[shown.places]
    bound = np.concatenate([binding.points, vertices])
    unseen = [_confidence(mesh, bound, present + k, 0, noise).hidden for k in range(count + 1)]
    named = [tuple(mesh.shape_names[s] for s in hidden.tolist()) for hidden in unseen]
    where = place_names(mesh, vertices, binding)
    return MarkerPlaces(vertices, where, named[0], tuple(named[1:]))


def _confidence(mesh: Mesh, places: IntArray, bound: int, wanted: int, noise: float) -> Confidence:
    """Say how sure a solve with markers on the first `bound` places is."""
    return confidence_of(
        mesh.points[places],
        mesh.offsets_at(places),
        np.arange(bound),
        3,
        True,
        1.0 / _RATE,
        (noise, _MISFIT),
        SolveOptions(),
        wanted,
    )
