"""The mesh of a character that markers sit on, among those with shape keys."""

import bpy
import numpy as np

# As in `usdface.rigs.face_mesh`: meshes with this share of the shapes of the one that the most move
# are parts of one face, and the largest of these is the head.
_SHARED = 0.75


def face_of(meshes: list[bpy.types.Object]) -> bpy.types.Object:
    """Return the mesh that the most shape keys move, or a larger one that they move, too.

    Avatars carry all shape keys on eyes, teeth and lashes as well, where most of them move nothing.
    """
    if len(meshes) == 1:
        return meshes[0]
    moved = {mesh.name: _moved(mesh) for mesh in meshes}

    def size(mesh: bpy.types.Object) -> float:
        return moved[mesh.name][1]

    first = max(meshes, key=lambda mesh: (len(moved[mesh.name][0]), size(mesh)))
    shared = moved[first.name][0]
    parts = [m for m in meshes if len(shared & moved[m.name][0]) >= _SHARED * len(shared)]
    return max(parts, key=size) if shared else meshes[0]


def _moved(mesh: bpy.types.Object) -> tuple[set[str], float]:
    """Return the shape keys that move a vertex, and the diagonal around all of these."""
    keys = mesh.data.shape_keys
    names, any_moved = set(), np.zeros(len(mesh.data.vertices), bool)
    for key in keys.key_blocks:
        if key != keys.reference_key:
            moves = (_points(key) != _points(key.relative_key)).any(axis=1)
            any_moved |= moves
            names |= {key.name} if moves.any() else set()
    turned = np.array(mesh.matrix_world)[:3, :3]
    points = _points(keys.reference_key)[any_moved] @ turned.T
    return names, float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _points(key: bpy.types.ShapeKey) -> np.ndarray:
    points = np.empty(3 * len(key.data), np.float32)
    key.data.foreach_get("co", points)
    return points.reshape(-1, 3)
