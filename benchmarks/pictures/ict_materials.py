"""Materials of the ICT face, which its files lack: eyes, mouth, and sheets that let light through.

Tear film, the sheets that shade the eyes and the lashes would otherwise be drawn as skin, and a
closed eye as a crumpled one. Vertex ranges are those of ICT-FaceKit's README (USC ICT, MIT).
"""

from dataclasses import replace

import numpy as np

from usdface.materials import Material
from usdface.rigs import MaterialSubset, Mesh, Rig

__all__ = ["with_ict_materials"]

_MATERIALS = {
    "mouth": Material("mouth", (0.25, 0.08, 0.07)),
    "gums": Material("gums", (0.35, 0.12, 0.11)),
    "teeth": Material("teeth", (0.75, 0.7, 0.6)),
    "eye": Material("eye", (0.8, 0.78, 0.75), roughness=0.3),
    "iris": Material("iris", (0.06, 0.12, 0.2), roughness=0.3),
    "clear": Material("clear", opacity=0.0),
}
# First vertex of each part, and the one after the last.
_PARTS = {
    "mouth": (11248, 13294),
    "gums": (14062, 17039),
    "teeth": (17039, 21451),
    "eye": (21451, 24591),
    "clear": (24591, 26719),
}
_EYEBALLS = ((21451, 23021), (23021, 24591))
# The iris is within this angle of an eyeball's front [radians]: 12 mm across on a 24 mm eye.
_IRIS = 0.5


def with_ict_materials(rig: Rig) -> Rig:
    """Return a rig of the whole ICT face as a single mesh, with materials."""
    (mesh,) = rig.meshes
    named = _face_materials(mesh)
    subsets = tuple(MaterialSubset(name, np.flatnonzero(named == name)) for name in _MATERIALS)
    return replace(
        rig, meshes=(replace(mesh, subsets=subsets),), materials=tuple(_MATERIALS.values())
    )


def _face_materials(mesh: Mesh) -> np.ndarray:
    """Return the name of the material of each face, "" for skin: (P,) str."""
    of_vertices = np.full(len(mesh.points), "", dtype="<U8")
    for name, (first, end) in _PARTS.items():
        of_vertices[first:end] = name
    for first, end in _EYEBALLS:
        outwards = mesh.points[first:end] - mesh.points[first:end].mean(axis=0)
        front = outwards[:, 2] > np.cos(_IRIS) * np.linalg.norm(outwards, axis=1)
        of_vertices[first:end][front] = "iris"
    starts = np.cumsum(mesh.face_counts) - mesh.face_counts
    return np.asarray(of_vertices[mesh.face_indices[starts]])
