"""Rigs that the readers of other packages return, held to the rules of usdface's own readers."""

from collections.abc import Iterator

import numpy as np

from usdface.findings import Finding
from usdface.formats import RigReader
from usdface.io.format_table import Registered
from usdface.rigs import Mesh, Rig

__all__ = ["verified_rig"]


def verified_rig(reader: Registered[RigReader], result: object) -> tuple[Rig, list[Finding]]:
    """Return a reader's rig and findings, checked.

    The types check shapes of arrays, points, faces and blend shapes when they are made; this
    function checks all other values of a mesh.

    Raises
    ------
    PluginError
        If `result` is no rig with its findings.
    """
    if not (isinstance(result, tuple) and len(result) == 2):
        raise reader.wrong(f"{type(result).__name__}; expected (rig, findings)")
    rig, findings = result[0], reader.findings(result[1])
    if not isinstance(rig, Rig) or not all(isinstance(mesh, Mesh) for mesh in rig.meshes):
        raise reader.wrong(f"{type(rig).__name__}; expected a Rig of meshes")
    for mesh in rig.meshes:
        for fault in _faults(mesh, len(rig.skeleton.joints) if rig.skeleton else 0):
            raise reader.wrong(f"mesh {mesh.name!r} with {fault}")
    return rig, findings


def _faults(mesh: Mesh, joints: int) -> Iterator[str]:
    """Yield the faults of a mesh that `Mesh` does not check itself."""
    points = len(mesh.points)
    if len(mesh.face_counts) and mesh.face_counts.min() < 3:
        yield f"a face of {mesh.face_counts.min()} corners; expected 3 or more"
    if not all(isinstance(name, str) and name.strip() for name in (mesh.name, *mesh.shape_names)):
        yield "a name that is no text; expected one for the mesh and for each blend shape"
    for name, values in (("normals", mesh.normals), ("texture coordinates", mesh.uvs)):
        if values is not None and not np.isfinite(values).all():
            yield f"{name} that are not finite; expected finite numbers"
    if mesh.skin is not None:
        indices, weights = mesh.skin.joints, mesh.skin.weights
        whole = weights.shape == indices.shape and np.isfinite(weights).all()
        if len(indices) != points or not whole:
            yield f"a skin {weights.shape}; expected joints and weights for {points} points"
        elif indices.size and not 0 <= indices.min() <= indices.max() < joints:
            yield f"skin joints outside 0 to {joints - 1}"
    for subset in mesh.subsets:
        faces = subset.faces
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(mesh.face_counts):
            yield f"faces of the material {subset.material!r} outside the mesh"
