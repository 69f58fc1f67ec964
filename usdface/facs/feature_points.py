"""Feature points of a rig's face, found by anatomy and never by the names of blend shapes.

Lids and lips are where skin meets (`usdface.face.lip_lid_contacts`), the other points are those of
an average face mapped by the landmarks. Where a dead shape hides an eye, every blend
shape is joined by its mirror image while they are searched. Each point is a small patch of skin,
and its displacement is the mean of its vertices'.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray, frozen
from usdface.binding.face_surface import face_surface
from usdface.binding.landmarks import FaceLandmarks, find_landmarks
from usdface.blend_shapes.evaluator import shape_places
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.errors import InputError
from usdface.face.lip_lid_contacts import LipLidContacts, find_lip_lid_contacts, widest_pair
from usdface.face.marker_name_places import LANDMARKS
from usdface.facs.loose_parts import Patches, eyeballs, loose_patches
from usdface.facs.movements import POINTS
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.rigs.face_mesh import moved_vertices, vertex_motion

__all__ = ["FeaturePoints", "find_feature_points"]

# On the average face [mm], as `usdface.face.marker_name_places`; x of the left half.
_SIDED = {
    "inner brow": (16, 24),
    "middle brow": (34, 25),
    "outer brow": (54, 18),
    "upper cheek": (34, -20),
    "cheek": (42, -38),
    "lower cheek": (42, -62),
    "nose bridge": (6, -7),
    "nose side": (10, -14),
    "nose wing": (17, -40),
    "nasolabial fold": (24, -50),
    "jaw": (30, -104),
}
_CENTRAL = {
    "glabella": (0, 18),
    "nose root": (0, 4),
    "nose tip": (0, -36),
    "philtrum": (0, -57),
    "lip groove": (0, -84),
    "chin boss": (0, -98),
    "chin": (0, -112),
}
_PATCH = 4.0  # [mm of the average face] along the surface: the reach of a small optical marker
# The skin of the brows begins so high above the eyes [mm of the average face]: half-way from the
# lid to the brow.
_ABOVE_LID = 0.5 * (LANDMARKS["lid upper"][1] + LANDMARKS["brow"][1])
_BROW = (LANDMARKS["brow"][0] - LANDMARKS["eye inner"][0]) / (
    LANDMARKS["eye outer"][0] - LANDMARKS["eye inner"][0]
)


@dataclass(frozen=True, eq=False, slots=True)
class FeaturePoints:
    """Patches of vertices on the meshes of a rig, for the feature points that were found.

    Attributes
    ----------
    patches : mapping of str to (int, (N,) int64)
        By the names of `usdface.facs.movements.POINTS`: index of the mesh, vertices.
    unit : float [m]
        Length on the rig of a millimetre on the average face.
    """

    patches: Mapping[str, tuple[int, IntArray]]
    unit: float

    def moved(self, rig: Rig, names: tuple[str, ...]) -> FloatArray:
        """Return the displacement of each point by each blend shape at weight 1.

        Parameters
        ----------
        rig : Rig
        names : tuple of str, length S
            Blend shapes of the rig.

        Returns
        -------
        (S, len(POINTS), 3) float64 [mm of a human head]
            0 for points that were not found.
        """
        result = np.zeros((len(names), len(POINTS), 3))
        row = {name: i for i, name in enumerate(names)}
        for column, point in enumerate(POINTS):
            if point not in self.patches:
                continue
            which, vertices = self.patches[point]
            mesh = rig.meshes[which]
            rows = [row[name] for name in mesh.shape_names if name in row]
            known = [name in row for name in mesh.shape_names]
            result[rows, column] = mesh.offsets_at(vertices).mean(axis=1)[known]
        return frozen(result / self.unit)

    def displaced(self, rig: Rig, names: tuple[str, ...], weights: FloatArray) -> FloatArray:
        """Return the displacement of each point where all shapes have weights.

        Parameters
        ----------
        rig : Rig
        names : tuple of str, length S
            Blend shapes of the rig; inbetweens and combination shapes follow.
        weights : (F, S) float64

        Returns
        -------
        (F, len(POINTS), 3) float64 [mm of a human head]
        """
        result = np.zeros((len(weights), len(POINTS), 3))
        for which, mesh in enumerate(rig.meshes):
            here = {p: v for p, (at, v) in self.patches.items() if at == which}
            if not here or not mesh.shapes:
                continue
            vertices = np.unique(np.concatenate(list(here.values())))
            evaluator, _ = evaluator_of(mesh.shapes, vertices)
            order = shape_places(mesh.shape_names, names)
            own = np.where(order >= 0, weights[:, order], 0.0)
            moved = evaluator.displacements(evaluator.combined(own))
            moved = moved.reshape(len(weights), len(vertices), 3)
            for point, patch in here.items():
                at = np.searchsorted(vertices, patch)
                result[:, POINTS.index(point)] = moved[:, at].mean(axis=1)
        return frozen(result / self.unit)

    def centres(self, rig: Rig) -> dict[str, FloatArray]:
        """Return the place of each point on the neutral face: (3,) each [m]."""
        return {
            point: rig.meshes[which].points[vertices].mean(axis=0)
            for point, (which, vertices) in self.patches.items()
        }


def find_feature_points(rig: Rig) -> FeaturePoints:
    """Find the feature points of a rig's face.

    Raises
    ------
    InputError
        If no blend shape moves visible skin, or none reveals lids and lips.
    """
    face = rig.face()
    which = next(i for i, mesh in enumerate(rig.meshes) if mesh is face)
    contacts = find_lip_lid_contacts(face)
    landmarks = find_landmarks(face_surface(face), contacts)
    if landmarks is None:
        completed = _with_mirrored(face)
        contacts = find_lip_lid_contacts(completed)
        landmarks = find_landmarks(face_surface(completed), contacts)
    if landmarks is None:
        raise InputError(
            f"the blend shapes of {rig.name or rig.source!r} show no lids and lips; action units "
            "need a face that closes its eyes and opens its mouth",
            "SKIN_MISSING",
        )
    landmarks = _with_own_brows(landmarks)
    surface = landmarks.surface
    vertices = _carried_over(landmarks) | _lips_and_lids(landmarks, contacts)
    away = surface.distances(np.array(list(vertices.values())), _PATCH * landmarks.unit)
    patches: Patches = {}
    for (point, vertex), distance in zip(vertices.items(), away, strict=True):
        near = surface.vertices[distance <= _PATCH * landmarks.unit]
        patches[point] = (which, near if len(near) else np.array([vertex]))
    loose = loose_patches(rig, landmarks, patches)
    return FeaturePoints(patches | loose | eyeballs(rig, landmarks), landmarks.unit)


def _with_mirrored(mesh: Mesh) -> Mesh:
    """Return the mesh with the mirror image of each blend shape as well."""
    across = mesh.points[moved_vertices(mesh), 0]
    if not len(across):
        return mesh
    ends = across.min() + across.max()
    _, partner = cKDTree(mesh.points).query(mesh.points * (-1, 1, 1) + (ends, 0, 0))
    shapes = []
    for shape in mesh.shapes:
        dense = np.zeros((len(mesh.points), 3))
        dense[shape.indices] = shape.offsets
        dense = dense[partner] * (-1, 1, 1)
        moved = np.flatnonzero(dense.any(axis=1))
        shapes.append(
            replace(
                shape,
                name=f"{shape.name} mirrored",
                indices=moved,
                offsets=dense[moved],
                normal_offsets=None,
                inbetweens=(),
                combination=None,
            )
        )
    return replace(mesh, shapes=(*mesh.shapes, *shapes))


def _with_own_brows(landmarks: FaceLandmarks) -> FaceLandmarks:
    """Return the landmarks with brows where the skin above the lids moves, by any shape."""
    surface, unit = landmarks.surface, landmarks.unit
    points = surface.mesh.points
    brow = np.isclose(landmarks.average[:, 1], LANDMARKS["brow"][1])
    found = dict(zip(map(tuple, landmarks.average.tolist()), landmarks.points, strict=True))
    (inner, _), (outer, _) = LANDMARKS["eye inner"], LANDMARKS["eye outer"]
    least = unit * _ABOVE_LID + np.mean([found[s * inner, 0.0][1] for s in (1, -1)])
    motion = vertex_motion(
        (shape for shape in surface.mesh.shapes if _height(shape, points) > least), len(points)
    )
    average, placed = landmarks.average[~brow].tolist(), list(landmarks.points[~brow])
    for side in (1, -1):
        own = side * (surface.points[:, 0] - landmarks.middle) > 0.0
        weight = np.where(own & (surface.points[:, 1] > least), motion[surface.vertices], 0.0)
        if weight.any():
            y, z = np.average(surface.points, axis=0, weights=weight)[1:]
            ends = found[side * inner, 0.0][0], found[side * outer, 0.0][0]
            placed.append(np.array([ends[0] + _BROW * (ends[1] - ends[0]), y, z]))
            average.append([side * LANDMARKS["brow"][0], LANDMARKS["brow"][1]])
    return replace(landmarks, average=np.array(average), points=np.array(placed))


def _height(shape: BlendShape, points: FloatArray) -> float:
    """Return the height of the centre of a shape's motion [m]; -inf of one that moves nothing."""
    squares = (shape.offsets**2).sum(axis=1)
    return (
        float(np.average(points[shape.indices, 1], weights=squares)) if squares.any() else -np.inf
    )


def _carried_over(landmarks: FaceLandmarks) -> dict[str, int]:
    """Return the vertices of the points mapped from the average face."""
    places: dict[str, tuple[float, float]] = {}
    for half, sign in (("left", 1), ("right", -1)):
        places |= {f"{half} {point}": (sign * x, y) for point, (x, y) in _SIDED.items()}
    places |= _CENTRAL
    at = landmarks.vertices_at(np.array(list(places.values()), dtype=np.float64))
    return dict(zip(places, landmarks.surface.vertices[at].tolist(), strict=True))


def _lips_and_lids(landmarks: FaceLandmarks, contacts: LipLidContacts) -> dict[str, int]:
    """Return the vertices of the points on the rims of lips and lids."""
    surface, middle = landmarks.surface, landmarks.middle
    points = surface.mesh.points
    across = points[contacts.mouth].mean(axis=1)[:, 0] - middle
    found: dict[str, int] = {}
    for name, share in (("middle {}", 0.0), ("left {}", 0.5), ("right {}", -0.5)):
        upper, lower = contacts.mouth[np.abs(across - share * np.abs(across).max()).argmin()]
        found |= {name.format("upper lip"): int(upper), name.format("lower lip"): int(lower)}
    front = surface.vertices[surface.level]
    corner = LANDMARKS["mouth corner"]
    for half, sign in (("left", 1), ("right", -1)):
        upper, lower = widest_pair(points, contacts.lids_of_eye(points, sign, middle))
        found |= {f"{half} upper lid": int(upper), f"{half} lower lid": int(lower)}
        at = (landmarks.average == np.multiply(corner, (sign, 1))).all(axis=1).argmax()
        nearest = np.linalg.norm(points[front] - landmarks.points[at], axis=1).argmin()
        found[f"{half} lip corner"] = int(front[nearest])
    return found
