"""The mesh and the take that a binding was made with, to detect other ones."""

import hashlib
from dataclasses import dataclass

import numpy as np

from usdface.errors import InputError
from usdface.rigs import Mesh
from usdface.takes import MarkerTake

__all__ = ["BindingOrigin", "check_mesh", "mesh_difference", "origin_of", "take_differs"]

# Of the travel: files keep positions in single precision.
_SAME_TRAVEL = 1e-4


@dataclass(frozen=True, slots=True)
class BindingOrigin:
    """The mesh and the take that a binding was made with.

    Attributes
    ----------
    points, faces : int
        Of the bound mesh.
    topology : str
        Digest of its faces, independent of its points.
    take : str
        File of the take, whose frames the binding names as neutral and peaks.
    frames : int
        0 = the take is not known.
    travel : float [m]
        RMS deviation of its markers from their mean places, to distinguish takes of one name.
    """

    points: int
    faces: int
    topology: str
    take: str = ""
    frames: int = 0
    travel: float = 0.0


def origin_of(mesh: Mesh, take: MarkerTake) -> BindingOrigin:
    """Return the origin of a binding that is made now."""
    return BindingOrigin(
        len(mesh.points),
        len(mesh.face_counts),
        _topology(mesh),
        take.source,
        len(take.times),
        _travel(take),
    )


def mesh_difference(origin: BindingOrigin, mesh: Mesh) -> str:
    """Return how a mesh differs from that of a binding; "" if only its points may differ."""
    for name, was, there in (
        ("points", origin.points, len(mesh.points)),
        ("faces", origin.faces, len(mesh.face_counts)),
    ):
        if was != there:
            return f"that had {was} {name}, this one has {there}"
    if origin.topology != _topology(mesh):
        return "both have as many points and faces, but the faces connect other points"
    return ""


def check_mesh(origin: BindingOrigin, mesh: Mesh) -> None:
    """Refuse a mesh that is not that of a binding.

    Raises
    ------
    InputError
    """
    if difference := mesh_difference(origin, mesh):
        raise InputError(
            f"the binding was made for another mesh than {mesh.name!r}: {difference}; bind this "
            'one anew, or leave "made_with" out of the binding if its vertices are right',
            "BINDING_OTHER_MESH",
        )


def take_differs(origin: BindingOrigin, take: MarkerTake) -> bool:
    """Return whether a take is not that of a binding."""
    if not origin.frames:
        return False  # it is of a shot, whose frames are those of its take
    if (origin.take, origin.frames) != (take.source, len(take.times)):
        return True
    return abs(origin.travel - _travel(take)) > _SAME_TRAVEL * max(origin.travel, 1e-6)


def _topology(mesh: Mesh) -> str:
    digest = hashlib.sha256()
    for values in (mesh.face_counts, mesh.face_indices):
        digest.update(np.asarray(values, np.int64).tobytes())
    return digest.hexdigest()[:16]


def _travel(take: MarkerTake) -> float:
    positions = take.positions
    seen = ~np.isnan(positions)
    count = np.maximum(seen.sum(axis=0), 1)
    mean = np.where(seen, positions, 0.0).sum(axis=0) / count
    away = np.where(seen, positions - mean, 0.0)
    return float(np.sqrt((away**2).sum() / max(seen.sum(), 1)))
