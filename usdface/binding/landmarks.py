"""Landmarks of a rig's face, found by its blend shapes and surface.

Eyes are where lids close, the mouth is where lips part, brows are moved by brow shapes; the tip of
the nose is foremost between them, and the chin ends where the midline recedes below the mouth.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.binding.face_surface import FaceSurface
from usdface.face.lip_lid_contacts import LipLidContacts, find_lip_lid_contacts, widest_pair
from usdface.face.marker_name_places import LANDMARKS
from usdface.face.regions import shape_regions
from usdface.rigs.face_mesh import vertex_motion

__all__ = ["FaceLandmarks", "find_landmarks"]

# Shares of the eye corners' distance: the nose's tip and the chin are so near to the midline, and
# the columella nearer. The tip is above the mouth by a share of the height between mouth and eyes.
_NOSE_WIDTH, _MIDDLE, _NOSE_ABOVE = 0.1, 0.01, 0.25
# A brow is above this share of the way from the inner to the outer corner of the eye.
_INNER, _OUTER = LANDMARKS["eye inner"][0], LANDMARKS["eye outer"][0]
_BROW = (LANDMARKS["brow"][0] - _INNER) / (_OUTER - _INNER)
# The chin ends where the midline is this far behind the lips, in heights between mouth and eyes.
_CHIN_BACK = 0.35

# Landmarks by name and side, 1 = left, -1 = right, 0 = on the midline: (3,) float64 [m] each.
_Found = dict[tuple[str, int], FloatArray]


@dataclass(frozen=True, eq=False, slots=True)
class FaceLandmarks:
    """Landmarks of a face, and the map from the average face through them.

    Attributes
    ----------
    surface : FaceSurface
    average : (L, 2) float64 [mm]
        On the average face (`usdface.face.marker_name_places.LANDMARKS`), left and right.
    points : (L, 3) float64 [m]
        On the rig.
    unit : float [m]
        Length on the rig of a millimetre on the average face.
    middle : float [m]
        x of the midline.
    """

    surface: FaceSurface
    average: FloatArray
    points: FloatArray
    unit: float
    middle: float

    def __post_init__(self) -> None:
        freeze(self, "average", "points")

    def vertices_at(self, places: FloatArray) -> IntArray:
        """Return the vertices of the surface at places (N, 2) on the average face [mm]: (N,).

        A thin plate spline through the landmarks maps them, as seen from the front.
        """
        flat = RBFInterpolator(
            self.average, self.points[:, :2], kernel="thin_plate_spline", degree=1
        )(places)
        front = np.flatnonzero(self.surface.level & (self.surface.normals[:, 2] > 0.0))
        return np.asarray(front[cKDTree(self.surface.points[front, :2]).query(flat)[1]])


def find_landmarks(
    surface: FaceSurface, contacts: LipLidContacts | None = None
) -> FaceLandmarks | None:
    """Find the landmarks of a face; None if its blend shapes move no lips or no lids.

    Parameters
    ----------
    surface : FaceSurface
    contacts : LipLidContacts, optional
        Of its mesh, if they are known.
    """
    contacts = contacts or find_lip_lid_contacts(surface.mesh)
    if not len(contacts.mouth) or not len(contacts.lids):
        return None
    lips = surface.mesh.points[contacts.mouth].mean(axis=1)
    middle = 0.5 * float(lips[:, 0].min() + lips[:, 0].max())
    found = _eyes_and_mouth(surface, contacts, middle)
    if found is None:
        return None
    eyes = float(np.mean([p[1] for (name, _), p in found.items() if name.startswith("eye")]))
    height = eyes - float(np.median(lips[:, 1]))
    if height <= 0.0:
        return None
    found |= _brows(surface, contacts, found, middle, eyes)
    found |= _on_midline(surface, found, contacts, middle, eyes, height)
    average = [np.multiply(LANDMARKS[name], (side, 1)) for name, side in found]
    return FaceLandmarks(
        surface,
        np.array(average, dtype=np.float64),
        np.array(list(found.values())),
        height / -LANDMARKS["mouth corner"][1],
        middle,
    )


def _eyes_and_mouth(surface: FaceSurface, contacts: LipLidContacts, middle: float) -> _Found | None:
    """Return corners of eyes and mouth, and the lids where they open widest; None without an eye.

    `middle` [m] is the x of the midline.
    """
    points, found = surface.mesh.points, {}
    for side in (1, -1):
        lids = contacts.lids_of_eye(points, side, middle)
        if not len(lids):
            return None
        found["eye inner", side] = _corner(surface, lids, -side)
        found["eye outer", side] = _corner(surface, lids, side)
        found["mouth corner", side] = _corner(surface, contacts.mouth, side)
        found["lid upper", side], found["lid lower", side] = points[widest_pair(points, lids)]
    return found


def _brows(
    surface: FaceSurface, contacts: LipLidContacts, found: _Found, middle: float, eyes: float
) -> _Found:
    """Return the brows that brow shapes move above the eyes, which are at the height `eyes` [m]."""
    brows: _Found = {}
    shapes = shape_regions(surface.mesh, contacts)["brows"]
    for side in (1, -1):
        brow = _brow(surface, shapes, side, middle)
        if brow is not None and brow[1] > eyes:
            # Its x depends on which brow shapes there are, so that of the eye is used.
            inner, outer = found["eye inner", side], found["eye outer", side]
            brows["brow", side] = np.array([inner[0] + _BROW * (outer - inner)[0], *brow[1:]])
    return brows


def _on_midline(
    surface: FaceSurface,
    found: _Found,
    contacts: LipLidContacts,
    middle: float,
    eyes: float,
    height: float,
) -> _Found:
    """Return tip and base of the nose, and the chin, as far as the midline shows them.

    Parameters
    ----------
    surface : FaceSurface
    found : mapping
        With the outer corners of the eyes.
    contacts : LipLidContacts
    middle, eyes : float [m]
        x of the midline, and height of the eyes.
    height : float [m]
        From the mouth to the eyes.
    """
    midline: _Found = {}

    def centred(point: FloatArray) -> FloatArray:
        return point * [0, 1, 1] + [middle, 0, 0]

    rims = surface.mesh.points[contacts.mouth]
    lips = rims.mean(axis=1)
    width = abs(float(found["eye outer", 1][0] - found["eye outer", -1][0]))
    near = np.abs(surface.points[:, 0] - middle) < _NOSE_WIDTH * width
    on = surface.points[near & (surface.normals[:, 2] > 0.0)]  # not the insides of open lips
    nose = on[(on[:, 1] < eyes) & (on[:, 1] > eyes - (1.0 - _NOSE_ABOVE) * height)]
    if len(nose):
        tip = nose[nose[:, 2].argmax()]
        midline["nose tip", 0] = centred(tip)
        base = on[(on[:, 1] < tip[1]) & (on[:, 1] > rims[:, 0, 1].max())]
        base = base[np.abs(base[:, 0] - middle) < _MIDDLE * width]
        if len(base):
            midline["nose base", 0] = centred(_deepest(base, tip, rims[:, 0]))
    front = float(lips[:, 2].max()) - _CHIN_BACK * height
    chin = on[(on[:, 1] < lips[:, 1].min()) & (on[:, 2] > front)]
    if len(chin):
        midline["menton", 0] = centred(chin[chin[:, 1].argmin()])
    return midline


def _deepest(profile: FloatArray, tip: FloatArray, lips: FloatArray) -> FloatArray:
    """Return the point of a profile (N, 3) farthest behind the line from nose tip to lips."""
    lip = lips[lips[:, 2].argmax()]
    line = (lip - tip)[1:] / np.linalg.norm((lip - tip)[1:])
    behind = (profile - tip)[:, 2] * line[0] - (profile - tip)[:, 1] * line[1]
    return np.asarray(profile[behind.argmax()])


def _corner(surface: FaceSurface, pairs: IntArray, outwards: float) -> FloatArray:
    """Return the corner of a slit on the side of rising `outwards` x: (3,) [m].

    The way along the surface between its last two lips leads around it.
    """
    points = surface.mesh.points
    ends = outwards * points[pairs, 0].mean(axis=1)
    first, second = pairs[ends.argmax()].tolist()
    _, before = dijkstra(surface.graph, directed=False, indices=first, return_predecessors=True)
    way = [second]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return np.asarray(points[way[int((outwards * points[way, 0]).argmax())]])


def _brow(
    surface: FaceSurface, shapes: tuple[str, ...], side: int, middle: float
) -> FloatArray | None:
    """Return the centre of a side's skin that brow shapes move; None where they move none."""
    brow = (shape for shape in surface.mesh.shapes if shape.name in shapes)
    motion = vertex_motion(brow, len(surface.mesh.points))
    own = np.where(side * (surface.points[:, 0] - middle) > 0.0, motion[surface.vertices], 0.0)
    return np.average(surface.points, axis=0, weights=own) if own.any() else None
