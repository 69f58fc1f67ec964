import json
import struct
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.rigs import BlendShape, Inbetween, Material, MaterialSubset, Mesh, Rig, Skeleton, Skin


@pytest.fixture(scope="session")
def posed() -> Callable[[Mesh, np.ndarray], np.ndarray]:
    """The points of a mesh as UsdSkel defines them: straight through the inbetweens."""

    def points_at(mesh: Mesh, weights: np.ndarray) -> np.ndarray:
        points = mesh.points.copy()
        for shape, weight in zip(mesh.shapes, weights, strict=True):
            knots = [(0.0, np.zeros_like(shape.offsets)), (1.0, shape.offsets)]
            knots += [(b.weight, b.offsets) for b in shape.inbetweens]
            knots.sort(key=lambda knot: knot[0])
            at = np.array([k[0] for k in knots])
            right = int(np.clip(np.searchsorted(at, weight), 1, len(at) - 1))
            part = (weight - at[right - 1]) / (at[right] - at[right - 1])
            points[shape.indices] += (1 - part) * knots[right - 1][1] + part * knots[right][1]
        return points

    return points_at


@pytest.fixture(scope="session")
def baked() -> Callable[[Path, Iterable[float]], dict[str, np.ndarray]]:
    """World points of each mesh at time codes as UsdSkel itself computes them: (F, V, 3)."""
    from pxr import Sdf, Usd, UsdGeom, UsdSkel

    def bake(path: Path, codes: Iterable[float]) -> dict[str, np.ndarray]:
        # A copy: an open stage shares its layers with every other of that file.
        stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(path)))
        roots = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
        meshes = [p for r in roots for p in Usd.PrimRange(r) if p.IsA(UsdGeom.Mesh)]
        assert all(UsdSkel.BakeSkinning(Usd.PrimRange(root)) for root in roots)

        def world(prim: Usd.Prim, code: float) -> np.ndarray:
            matrix = np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))
            return (
                np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(code)) @ matrix[:3, :3]
                + matrix[3, :3]
            )

        return {str(p.GetPath()): np.array([world(p, code) for code in codes]) for p in meshes}

    return bake


def _grid(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(-1, 1, size), np.linspace(-1, 1, size))
    points = 0.1 * np.stack([x, y, 0.3 - 0.2 * (x**2 + y**2)], -1).reshape(-1, 3)
    corner = (np.arange(size - 1)[:, None] * size + np.arange(size - 1)).ravel()
    faces = np.stack([corner, corner + 1, corner + size + 1, corner + size], 1).ravel()
    uvs = np.stack([x, y], -1).reshape(-1, 2)[faces] * 0.5 + 0.5
    return points, np.full((size - 1) ** 2, 4), faces, uvs


@pytest.fixture
def face_rig() -> Rig:
    """A bulging 6x6 sheet and a plain triangle; shapes with awkward names, an inbetween."""
    rng = np.random.default_rng(7)
    points, counts, faces, uvs = _grid(6)

    def shape(name: str, indices: list[int], inbetweens: tuple[Inbetween, ...] = ()) -> BlendShape:
        return BlendShape(name, indices, rng.normal(0, 0.01, (len(indices), 3)), None, inbetweens)

    half = (
        Inbetween("half way", 0.5, rng.normal(0, 0.01, (4, 3))),
        Inbetween("back", -0.4, rng.normal(0, 0.01, (4, 3))),
    )
    shapes = (
        shape("jawOpen", [0, 3, 4, 9], half),
        shape("Key 1", [7, 8, 30, 35]),
        shape("Key.1", [1]),
        shape("口", [14, 15, 20, 21, 22]),
    )
    subsets = (MaterialSubset("lips", np.arange(5)), MaterialSubset("skin", np.arange(5, 25)))
    head = Mesh("Head", points, counts, faces, None, uvs, shapes, None, "", subsets)
    jaw = Mesh("Teeth.1", points[[0, 1, 7]], [3], [0, 1, 2], shapes=(shape("jawOpen", [0, 2]),))
    materials = (
        Material("skin", (0.5, 0.4, 0.3), 0.9, 0.1, 0.7, (0.0, 0.1, 0.0), alpha_mode="blend"),
        Material("lips", (0.9, 0.1, 0.1), double_sided=True),
    )
    return Rig("small face", (head, jaw), None, materials)


@pytest.fixture
def skinned_rig(face_rig: Rig) -> Rig:
    """The sheet of `face_rig` on two joints whose rest pose is their bind pose."""
    mesh = face_rig.meshes[0]
    weight = np.linspace(0, 1, len(mesh.points))
    skin = Skin(np.tile([0, 1], (len(weight), 1)), np.stack([1 - weight, weight], 1))
    root, head = np.eye(4), np.eye(4)
    root[:3, :3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    root[3, :3] = (0.0, -0.2, 0.0)
    head[3, :3] = (0.1, 0.0, 0.05)
    skeleton = Skeleton(
        ("neck", "neck/head"), ("neck", "Head Joint"), [root, head @ root], [root, head]
    )
    return Rig("skinned face", (replace(mesh, skin=skin, subsets=()),), skeleton)


@pytest.fixture(scope="session")
def write_glb() -> Callable[..., Path]:
    """A function that writes a GLB by hand: accessor k is `arrays[k]`, in a view of its own."""
    codes = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
    kinds = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

    def write(path: Path, document: dict[str, Any], arrays: list[np.ndarray]) -> Path:
        blob, views, accessors = b"", [], []
        for number, array in enumerate(arrays):
            array = array.reshape(len(array), -1)
            views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
            code = codes[array.dtype.str[1:]]
            kind = kinds[array.shape[1]]
            accessors.append(
                {"bufferView": number, "componentType": code, "count": len(array), "type": kind}
            )
            blob += array.tobytes() + bytes(-array.nbytes % 4)
        base = {"asset": {"version": "2.0"}, "bufferViews": views, "accessors": accessors}
        if blob:
            base["buffers"] = [{"byteLength": len(blob)}]
        text = json.dumps(base | document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(blob), b"BIN\0") + blob
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path

    return write
