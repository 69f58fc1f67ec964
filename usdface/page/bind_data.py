"""The data of a page to place markers on: proposals on the face, the take beside it."""

import json
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.binding.stabilised_take import FEWEST_MARKERS, stabilised_take
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.mirror import midline, mirrored_markers
from usdface.page.clip_data import ticks
from usdface.page.packed_data import Quantized
from usdface.page.performer import markers_on_face
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["bind_data", "mirror_vertices", "motion_curve"]

_NO_HEAD = np.zeros((0, 4, 4))


def bind_data(take: MarkerTake, mesh: Mesh, setup: RetargetSetup, document: str) -> dict[str, Any]:
    """Return a binding as a tree for `usdface.page.packed_data.pack_data`.

    Parameters
    ----------
    take : MarkerTake
    mesh : Mesh
        The one that markers are bound to.
    setup : RetargetSetup
        As given, or proposed.
    document : str
        The binding file of the setup: the page keeps all other keys of it.
    """
    rows = [_place(name, setup) for name in take.names]
    known = [row for row in rows if row["point"] >= 0]
    face = _face(mesh, known, setup)
    still = _stabilised(take)
    positions = markers_on_face(still, setup, _face(mesh, _telling(rows), setup), _NO_HEAD)
    first, last = setup.neutral or (0, 0)
    return {
        "document": json.loads(document),
        "markers": rows,
        "partners": _partners(positions[first : last + 1], face),
        "middle": _middle(face),
        "mirror": mirror_vertices(mesh, _middle(face)),
        "neutral": None if setup.neutral is None else [first, last],
        "nose_tip": setup.nose_tip,
        "clip": {"name": "take", "rate": take.rate or 30.0, "ticks": ticks(take.times)},
        "start_timecode": take.start_timecode,
        "positions": Quantized(positions),
        "motion_mm": Quantized(1000.0 * motion_curve(positions, (first, last))),
    }


def _face(mesh: Mesh, rows: list[dict[str, Any]], setup: RetargetSetup) -> BoundFace:
    points = np.array([row["point"] for row in rows], dtype=np.int64)
    binding = Binding(tuple(row["name"] for row in rows), points)
    return bound_face(mesh, RetargetSetup(binding, neutral=setup.neutral))


def _telling(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the markers whose places tell where the others are, beside the face.

    A few unsure places may all lie on one spot; markers that are fitted to it would be a speck.
    """
    bound = [row for row in rows if row["state"] == "bound"]
    known = [row for row in rows if row["point"] >= 0]
    if len(bound) >= FEWEST_MARKERS:
        return bound
    return known if 2 * len(known) >= len(rows) else []


def _place(name: str, setup: RetargetSetup) -> dict[str, Any]:
    """Return the vertex of a marker, its confidence, and whether it is bound."""
    for state, binding in (("bound", setup.binding), ("unsure", setup.unsure)):
        if name in binding.markers:
            i = binding.markers.index(name)
            share = np.nan if binding.confidence is None else binding.confidence[i]
            known = None if np.isnan(share) else round(float(share), 3)
            point = int(binding.points[i])
            return {"name": name, "point": point, "confidence": known, "state": state}
    return {"name": name, "point": -1, "confidence": None, "state": "out"}


def _stabilised(take: MarkerTake) -> MarkerTake:
    """Return a take without head motion, where it has enough markers to tell."""
    seen = take.visible
    if take.dimension != 3 or seen.sum(axis=1).max() < FEWEST_MARKERS:
        return take
    used = seen.any(axis=0)
    positions = take.positions.copy()
    positions[:, used] = stabilised_take(take.positions[:, used]).positions
    return MarkerTake(take.names, take.times, positions, take.rate, source=take.source)


def motion_curve(positions: FloatArray, neutral: tuple[int, int]) -> FloatArray:
    """Return the RMS displacement of the markers from the neutral frames: (F,) [m].

    It is NaN in frames that show no marker, which are no rest.
    """
    seen = ~np.isnan(positions[..., 0])
    rest = np.where(seen[..., None], positions, 0.0)[neutral[0] : neutral[1] + 1].sum(axis=0)
    count = seen[neutral[0] : neutral[1] + 1].sum(axis=0)
    rest = rest / np.maximum(count, 1)[:, None]
    usable = seen & (count > 0)
    squares = np.where(usable, ((positions - rest) ** 2).sum(axis=2), 0.0)
    counted = usable.sum(axis=1)
    motion = np.sqrt(squares.sum(axis=1) / np.maximum(counted, 1))
    return np.where(counted > 0, motion, np.nan)


def _partners(neutral: FloatArray, face: BoundFace) -> list[int]:
    """Return the mirror partner of each marker of the take, by where it rests; -1 = none."""
    seen = ~np.isnan(neutral[..., 0])
    total = np.where(seen[..., None], neutral, 0.0).sum(axis=0)
    rest = total / np.maximum(seen.sum(axis=0), 1)[:, None]
    known = np.flatnonzero(seen.any(axis=0))
    partners = np.full(len(rest), -1)
    if len(known) < FEWEST_MARKERS:
        return list(partners.tolist())
    found = mirrored_markers(rest[known], midline(rest[known], _middle(face)))
    paired = found >= 0
    partners[known[paired]] = known[found[paired]]
    return list(partners.tolist())


def _middle(face: BoundFace) -> float:
    """Return x of the centre of the vertices that blend shapes move [m]."""
    moved = [shape.indices for shape in face.mesh.shapes if shape.offsets.any()]
    if not moved:
        return float(face.mesh.points[:, 0].mean())
    x = face.mesh.points[np.unique(np.concatenate(moved)), 0]
    return float((x.min() + x.max()) / 2)


def mirror_vertices(mesh: Mesh, middle: float) -> IntArray:
    """Return the vertex nearest to the mirror image of each: (V,) int64."""
    images = mesh.points * (-1.0, 1.0, 1.0) + (2.0 * middle, 0.0, 0.0)
    return np.asarray(cKDTree(mesh.points).query(images)[1], np.int64)
