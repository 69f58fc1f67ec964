"""The ICT face of the real data as files: one PLY for the neutral and one for each expression."""

import json
from pathlib import Path

import numpy as np

from usdface.rigs import BlendShape, Mesh

__all__ = ["ict_mesh", "landmarks", "write_meshes"]


def landmarks(shared: Path) -> np.ndarray:
    """Return the vertices of the 68 facial landmarks: (68,) int64."""
    return np.array(_indices(shared)["idx_to_landmark_verts"])


def ict_mesh(shared: Path) -> Mesh:
    """Return the neutral and the 53 expressions in memory [m]."""
    packed = np.load(shared / "ict_facekit" / "ict_expressions.npz")
    shapes = tuple(
        BlendShape(name, packed[f"idx_{name}"], 0.01 * packed[f"off_{name}"].astype(np.float64))
        for name in _indices(shared)["expressions"]
    )
    points = 0.01 * packed["points"].astype(np.float64)
    return Mesh(
        "Face", points, packed["faceVertexCounts"], packed["faceVertexIndices"], shapes=shapes
    )


def write_meshes(shared: Path, folder: Path) -> None:
    """Write neutral.ply and the 53 expressions [cm] to `folder`, binary, in triangles."""
    packed = np.load(shared / "ict_facekit" / "ict_expressions.npz")
    faces = _ply_triangles(packed["faceVertexCounts"], packed["faceVertexIndices"])
    neutral = packed["points"]
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(neutral)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    folder.mkdir(parents=True)
    for name in ("neutral", *_indices(shared)["expressions"]):
        points = neutral.astype("<f4")
        if name != "neutral":
            points[packed[f"idx_{name}"]] += packed[f"off_{name}"]
        content = header.encode() + points.tobytes() + faces.tobytes()
        (folder / f"{name}.ply").write_bytes(content)


def _indices(shared: Path) -> dict[str, list]:
    return json.loads((shared / "ict_facekit" / "vertex_indices.json").read_text())


def _ply_triangles(counts: np.ndarray, indices: np.ndarray) -> np.ndarray:
    first = np.cumsum(counts) - counts
    quads = first[counts == 4]
    corners = np.concatenate([first[:, None] + [0, 1, 2], quads[:, None] + [0, 2, 3]])
    faces = np.empty(len(corners), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, indices[corners]
    return faces
