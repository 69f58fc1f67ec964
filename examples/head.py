"""The stylised head as a rig: meshes, materials, and the 52 blend shapes."""

from functools import lru_cache

import numpy as np

from examples import parts, topology
from examples.parts import Part, mirrored
from examples.shapes import ARKIT_NAMES, eye_turns, head_shapes, jaw_moves
from examples.skin import smooth
from examples.topology import FLIP
from usdface.arrays import FloatArray
from usdface.geometry.triangulation import triangle_fans
from usdface.geometry.vertex_normals import triangle_normals
from usdface.rigs import BlendShape, Material, MaterialSubset, Mesh, Rig

__all__ = ["MATERIALS", "build_head"]

MATERIALS = (
    Material("skin", base_color=(0.80, 0.52, 0.39), roughness=0.62),
    Material("lips", base_color=(0.62, 0.25, 0.22), roughness=0.45),
    Material("mouth", base_color=(0.16, 0.035, 0.035), roughness=0.8),
    Material("brow", base_color=(0.075, 0.035, 0.018), roughness=0.8),
    Material("lash", base_color=(0.030, 0.016, 0.010), roughness=0.8),
    Material("hair", base_color=(0.11, 0.050, 0.024), roughness=0.6),
    Material("sclera", base_color=(0.86, 0.85, 0.82), roughness=0.15),
    Material("limbus", base_color=(0.03, 0.06, 0.08), roughness=0.1),
    Material("iris", base_color=(0.07, 0.24, 0.30), roughness=0.1),
    Material("pupil", base_color=(0.004, 0.004, 0.004), roughness=0.05),
    Material("teeth", base_color=(0.86, 0.83, 0.76), roughness=0.25),
    Material("tongue", base_color=(0.55, 0.17, 0.16), roughness=0.5),
)


def _mesh(
    name: str,
    points: FloatArray,
    faces: list[tuple[int, ...]],
    materials: list[str],
    uvs: FloatArray,
    shapes: tuple[BlendShape, ...] = (),
) -> Mesh:
    counts = np.array([len(face) for face in faces])
    indices = np.concatenate([np.array(face) for face in faces])
    triangles = indices[triangle_fans(counts)[0]]
    names = np.array(materials)
    main = max(sorted(set(materials)), key=materials.count)
    subsets = tuple(
        MaterialSubset(material, np.flatnonzero(names == material))
        for material in sorted(set(materials) - {main})
    )
    return Mesh(
        name,
        points,
        counts,
        indices,
        normals=triangle_normals(points, triangles),
        uvs=uvs,
        shapes=shapes,
        material=main,
        subsets=subsets,
    )


def _front_uvs(points: FloatArray, faces: list[tuple[int, ...]]) -> FloatArray:
    """Return texture coordinates per corner: seen from around the head, seam at the back."""
    corners = np.concatenate([np.array(face) for face in faces])
    face = np.repeat(np.arange(len(faces)), [len(f) for f in faces])
    low, high = points.min(axis=0), points.max(axis=0)
    centre = (low + high) / 2
    u = np.arctan2(points[:, 0] - centre[0], points[:, 2] - centre[2])[corners] / (2 * np.pi)
    first = np.concatenate([[0], np.flatnonzero(np.diff(face)) + 1])
    u = u - np.round(u - u[first][face])  # a face on the seam stays in one piece
    v = (points[corners, 1] - low[1]) / (high[1] - low[1])
    return np.column_stack([u + 0.5, v])


def _part(name: str, part: Part, offsets: dict[str, FloatArray] | None = None) -> Mesh:
    uvs = _front_uvs(part.points, part.faces)
    shapes = [
        BlendShape.from_dense(shape, offsets[shape])
        for shape in ARKIT_NAMES
        if offsets and np.any(offsets.get(shape, 0))
    ]
    return _mesh(name, part.points, part.faces, part.materials, uvs, tuple(shapes))


def _other_side(offsets: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the shapes of a left part for its mirror image."""
    swap = {"Left": "Right", "Right": "Left"}
    result = {}
    for name, move in offsets.items():
        side = next((s for s in swap if name.endswith(s)), "")
        result[name.removesuffix(side) + swap.get(side, "")] = move * FLIP
    return result


def _carried(
    points: FloatArray, skin: FloatArray, shapes: dict[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return how points that lie on the skin move with it: the mean of the nearest vertices."""
    away = np.linalg.norm(points[:, None] - skin, axis=2)
    near = np.argsort(away, axis=1, kind="stable")[:, :8]
    share = 1 / (np.take_along_axis(away, near, axis=1) ** 2 + 0.003**2) ** 2
    share /= share.sum(axis=1, keepdims=True)
    return {name: np.einsum("vk,vkc->vc", share, move[near]) for name, move in shapes.items()}


def _tongue_out(points: FloatArray) -> FloatArray:
    """Return the tongue's way out between the teeth and down over the lower lip."""
    s = smooth((points[:, 2] - 0.03) / 0.042)[:, None]
    return s * (0, 0.003, 0.024) + s**3 * (0, -0.006, 0.008)


@lru_cache(maxsize=1)
def build_head() -> Rig:
    """Build the example's character: a friendly head with the 52 ARKit blend shapes."""
    base = topology.build()
    moves = head_shapes(base)
    faces, points = list(base.faces), base.points
    materials = np.full(len(faces), "skin", dtype=object)
    for material, where in (("lips", base.lips), ("mouth", base.inner), ("lash", base.lashes)):
        materials[where] = material
    for ear in (parts.ear(), mirrored(parts.ear())):
        faces += [tuple(v + len(points) for v in face) for face in ear.faces]
        points = np.concatenate([points, ear.points])
        materials = np.concatenate([materials, ear.materials])
    rest = ((0, len(points) - len(base.points)), (0, 0))  # the ears do not move
    head_moves = {name: np.pad(move, rest) for name, move in moves.items()}
    eye, brow, jaw, tongue = parts.eye(), parts.brow(), parts.teeth(False), parts.tongue()
    gaze, brow_moves = eye_turns(eye.points), _carried(brow.points, base.points, moves)
    tongue_moves = {**jaw_moves(tongue.points), "tongueOut": _tongue_out(tongue.points)}
    meshes = (
        _part("head", Part(points, faces, list(materials)), head_moves),
        _part("eye_left", eye, gaze),
        _part("eye_right", mirrored(eye), _other_side(gaze)),
        _part("brow_left", brow, brow_moves),
        _part("brow_right", mirrored(brow), _other_side(brow_moves)),
        _part("teeth_upper", parts.teeth(True)),
        _part("teeth_lower", jaw, jaw_moves(jaw.points)),
        _part("tongue", tongue, tongue_moves),
        _part("hair", parts.hair()),
    )
    return Rig("head", meshes, materials=MATERIALS)
