"""Wavefront OBJ: points, polygons, texture coordinates, in the file's own order.

trimesh reads OBJ too, but makes triangles of all polygons and one mesh, with points of its
own, for each material (seen with 5.2 on quads with texture seams). Shapes need the points
as they stand in the file.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError

__all__ = ["ObjMesh", "read_obj"]

# Contents of lines that are passed over, by their first words (appendix B1).
_KINDS = {
    "normals": {"vn"},
    "smoothing groups": {"s"},
    "points and lines": {"p", "l"},
    "curves and free-form surfaces": {"curv", "curv2", "surf"},
}
_UNSMOOTHED = ("s off", "s 0")
_LARGEST_FILE = 1 << 30  # bytes: some ten million points


@dataclass(frozen=True, eq=False, slots=True)
class ObjMesh:
    """Contents of an OBJ file, in its own unit and axes.

    Attributes
    ----------
    points : (V, 3) float64
    face_counts : (P,) int64
    face_indices : (C,) int64
    uvs : (C, 2) float64 or None
        Texture coordinates of the face corners.
    groups, materials : tuple of str, length P
        The `g` and `usemtl` that each face stands under; "" before the first.
    unread : tuple of str
        Further contents of the file, in words.
    """

    points: FloatArray
    face_counts: IntArray
    face_indices: IntArray
    uvs: FloatArray | None
    groups: tuple[str, ...]
    materials: tuple[str, ...]
    unread: tuple[str, ...] = ()


def read_obj(path: Path) -> ObjMesh:
    """Read an OBJ file; normals, colours of points, names of objects, lines and others are named.

    Raises
    ------
    InputError
        If the file cannot be read, holds no points, or its numbers make no sense.

    References
    ----------
    Wavefront, Advanced Visualizer manual, appendix B1 "Object Files": indices from 1, or
    negative and counted back from the line they stand on.
    """
    lines = _lines(path)
    points = _table(path, lines, "v", 3)
    if not len(points):
        raise InputError(
            f"{path} holds no OBJ points (lines `v x y z`); is it an OBJ file?", "FILE_UNREADABLE"
        )
    texture = _table(path, lines, "vt", 2)
    groups: list[str] = []
    materials: list[str] = []
    corners: list[list[str]] = []
    before: list[tuple[int, int]] = []  # points and texture coordinates above each face
    group = material = ""
    seen_points = seen_texture = 0
    for line in lines:
        word, _, rest = line.partition(" ")
        if word == "f":
            corners.append(rest.split())
            groups.append(group)
            materials.append(material)
            before.append((seen_points, seen_texture))
        elif word == "v":
            seen_points += 1
        elif word == "vt":
            seen_texture += 1
        elif word == "g":
            group = rest.strip()
        elif word == "usemtl":
            material = rest.strip()
    counts = np.array([len(face) for face in corners], np.int64)
    above = np.repeat(np.array(before, np.int64).reshape(-1, 2), counts, axis=0)
    numbers = _corner_numbers(path, [corner for face in corners for corner in face])
    indices = _zero_based(path, numbers[:, 0], above[:, 0], len(points), "point")
    uvs = None
    if len(texture) and numbers.shape[1] > 1 and len(numbers) and (numbers[:, 1] != 0).all():
        uvs = texture[_zero_based(path, numbers[:, 1], above[:, 1], len(texture), "texture")]
    unread = _unread(lines)
    if uvs is None and len(texture):
        unread = (*unread, "texture coordinates, which some faces lack")
    return ObjMesh(points, counts, indices, uvs, tuple(groups), tuple(materials), unread)


def _unread(lines: list[str]) -> tuple[str, ...]:
    """Return the contents beside points, faces, texture coordinates, groups and materials."""
    words = {line.partition(" ")[0] for line in lines if line not in _UNSMOOTHED}
    objects = {line for line in lines if line.startswith("o ")}
    coloured = any(line.startswith("v ") and len(line.split()) > 5 for line in lines)
    found = ["colours of points"] if coloured else []
    found += [name for name, kinds in _KINDS.items() if kinds & words]
    return (*found, "names of objects") if len(objects) > 1 else tuple(found)


def _lines(path: Path) -> list[str]:
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise InputError(
                f"{path} is larger than {_LARGEST_FILE >> 30} GiB; not a face mesh", "TOO_LARGE"
            )
        text = path.read_text("utf-8-sig", "replace")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}", "FILE_UNREADABLE") from error
    text = text.replace("\\\r\n", " ").replace("\\\n", " ").replace("\t", " ")
    return [line.strip() for line in text.splitlines()]


def _table(path: Path, lines: list[str], word: str, width: int) -> FloatArray:
    """Return the first `width` numbers of all lines that start with `word`."""
    start = f"{word} "
    rows = [line.split()[1 : width + 1] for line in lines if line.startswith(start)]
    try:
        table = np.array(rows, np.float64).reshape(len(rows), width)
    except ValueError as error:
        raise InputError(
            f"{path}: a line `{word}` does not hold {width} numbers; the file is damaged",
            "ROW_WRONG",
        ) from error
    if not np.isfinite(table).all():
        raise InputError(
            f"{path}: a line `{word}` holds a number that is not finite; export it again",
            "VALUES_WRONG",
        )
    return table


def _corner_numbers(path: Path, corners: list[str]) -> IntArray:
    """Return the numbers of corners written p, p/t, p//n or p/t/n: (C, 1 to 3), 0 = none."""
    if not corners:
        return np.zeros((0, 1), np.int64)
    text = " ".join(corners).replace("//", "/0/")
    width = text.partition(" ")[0].count("/") + 1
    try:
        return np.array(text.replace("/", " ").split(), np.int64).reshape(len(corners), width)
    except (ValueError, OverflowError) as error:
        raise InputError(
            f"{path}: the corners of the faces (lines `f`) are not all written alike; "
            "export it with the same p/t/n in all",
            "ROW_WRONG",
        ) from error


def _zero_based(
    path: Path, numbers: IntArray, above: IntArray, count: int, element: str
) -> IntArray:
    indices: IntArray = np.where(numbers < 0, above + numbers, numbers - 1)
    if len(indices) and not 0 <= indices.min() <= indices.max() < count:
        raise InputError(
            f"{path}: a face names a {element} that is not among the file's {count}; "
            "is the file cut off, or were points removed?",
            "POINT_INDICES_OUTSIDE",
        )
    return indices
