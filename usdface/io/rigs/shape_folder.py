"""A folder of meshes, one neutral and one file for each shape, as a rig."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import trimesh

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.units_and_axes import to_metres
from usdface.io.rigs.formats import mesh_files
from usdface.io.rigs.makehuman import target_files
from usdface.io.rigs.obj import read_obj
from usdface.options import RigOptions
from usdface.rigs import BlendShape, Material, MaterialSubset, Mesh, Rig

__all__ = ["read_shape_folder"]

_METERS_PER_UNIT = 0.01  # centimetres, as most programs write OBJ of heads
_NEUTRAL_WORDS = frozenset({"neutral", "basis", "base", "rest"})


def read_shape_folder(folder: Path, options: RigOptions) -> tuple[Rig, list[Finding]]:
    """Read one neutral mesh and the shapes beside it; each file's stem is its shape's name.

    The neutral is `options.neutral` (file name or stem) or the one file whose name has the
    word neutral, basis, base or rest. Offsets are the differences to it, point by point; a
    file with another number of points is left out. PLY polygons become triangles (trimesh
    reads them so), OBJ polygons stay.

    Raises
    ------
    InputError
        If the folder has no meshes or no one neutral, or a mesh cannot be read.
    """
    files = mesh_files(folder)
    if not files:
        raise InputError(
            f"{folder} has no OBJ or PLY files; "
            "expected the neutral mesh and one file for each blend shape",
            "FILE_UNREADABLE",
        )
    chosen = _neutral(folder, files, options.neutral)
    unit = _METERS_PER_UNIT if options.meters_per_unit is None else options.meters_per_unit
    space = to_metres(unit, options.up_axis)
    neutral, materials, findings = _read_neutral(chosen, space)
    others = [path for path in files if path != chosen]
    shapes, new_findings = _read_shapes(others, neutral, chosen.name, space)
    findings += new_findings + _left_out_targets(folder) + _meshes_below(folder)
    mesh = Mesh(
        name=neutral.name,
        points=neutral.points,
        face_counts=neutral.face_counts,
        face_indices=neutral.face_indices,
        normals=None,
        uvs=neutral.uvs,
        shapes=shapes,
        skin=None,
        material="",
        subsets=neutral.subsets,
    )
    return Rig(folder.resolve().name, (mesh,), None, materials, str(folder)), findings


def _read_shapes(
    files: Sequence[Path], neutral: Mesh, neutral_name: str, space: FloatArray
) -> tuple[tuple[BlendShape, ...], list[Finding]]:
    """Read the shapes of files with as many points as the neutral; report the others."""
    shapes: dict[str, BlendShape] = {}
    findings: list[Finding] = []
    for path in files:
        points, same_faces = _read_points(path, neutral)
        if len(points) != len(neutral.points):
            message = "{point_count} points; the neutral {file} has {expected_count}"
            counts = len(points), neutral_name, len(neutral.points)
            findings.append(finding("SHAPE_SKIPPED", str(path), message, *counts))
            continue
        if path.stem in shapes:
            message = "there is a shape {shape!r} already"
            findings.append(finding("SHAPE_SKIPPED", str(path), message, path.stem))
            continue
        if not same_faces:
            findings.append(finding("FACES_DIFFER", str(path)))
        shapes[path.stem] = BlendShape.from_dense(path.stem, points @ space - neutral.points)
        if not len(shapes[path.stem].indices):
            findings.append(finding("SHAPE_EMPTY", str(path)))
    return tuple(shapes.values()), findings


def _left_out_targets(folder: Path) -> list[Finding]:
    """Report MakeHuman's targets, which need a folder with one mesh or `base.obj`."""
    count = len(target_files(folder)[1])
    message = "{file_count} .target files are left out: MakeHuman's need their mesh as base.obj"
    dropped = finding("FEATURE_DROPPED", str(folder), message, count, feature="makehuman_targets")
    return [dropped] if count else []


def _meshes_below(folder: Path) -> list[Finding]:
    """Report meshes in folders below, of which none is read."""
    inner = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    counts = {path: len(mesh_files(path)) for path in inner}
    message = "{file_count} meshes in a folder below are not read"
    return [
        finding("SHAPE_SKIPPED", str(path), message, count)
        for path, count in counts.items()
        if count
    ]


def _neutral(folder: Path, files: list[Path], wanted: str) -> Path:
    def words(path: Path) -> list[str]:
        return re.split("[^a-z]+", path.stem.lower())

    tests: list[Callable[[Path], bool]]
    if wanted:
        tests = [lambda p: p.name == wanted, lambda p: p.stem == wanted]
    else:
        tests = [
            lambda p: p.stem.lower() in _NEUTRAL_WORDS,
            lambda p: not _NEUTRAL_WORDS.isdisjoint(words(p)),
            lambda p: any(word in p.stem.lower() for word in _NEUTRAL_WORDS),
        ]
    for test in tests:
        found = [path for path in files if test(path)]
        if len(found) == 1:
            return found[0]
        if found:
            names = ", ".join(path.name for path in found)
            raise InputError(
                f"{folder} has several neutral meshes ({names}); choose one with --neutral",
                "NEUTRAL_UNKNOWN",
            )
    names = ", ".join(path.name for path in files)
    missing = f"no mesh {wanted!r}" if wanted else "no mesh named neutral, basis, base or rest"
    raise InputError(
        f"{folder} has {missing}; choose one with --neutral: {names}", "NEUTRAL_UNKNOWN"
    )


def _read_neutral(
    path: Path, space: FloatArray
) -> tuple[Mesh, tuple[Material, ...], list[Finding]]:
    if path.suffix.lower() == ".ply":
        found, polygons = _read_ply(path)
        counts = np.full(len(found.faces), 3)
        points = np.asarray(found.vertices) @ space
        findings = [finding("FACES_TRIANGULATED", str(path))] if polygons != len(counts) else []
        findings += _unread(path, _other_properties(found))
        return Mesh(path.stem, points, counts, np.ravel(found.faces)), (), findings
    obj = read_obj(path)
    names = np.array(obj.materials)
    subsets = tuple(
        MaterialSubset(name, np.flatnonzero(names == name))
        for name in dict.fromkeys(obj.materials)
        if name
    )
    grouped = len({*obj.groups}) > 1
    findings = _unread(path, (*obj.unread, *(["groups of faces"] if grouped else [])))
    if subsets:
        message = "materials keep their names and faces; their colours (.mtl) are not read"
        findings.append(finding("FEATURE_DROPPED", str(path), message, feature="material_colours"))
    points = obj.points @ space
    mesh = Mesh(
        path.stem, points, obj.face_counts, obj.face_indices, None, obj.uvs, subsets=subsets
    )
    return mesh, tuple(Material(subset.material) for subset in subsets), findings


def _unread(path: Path, contents: Sequence[str]) -> list[Finding]:
    """Report further contents of the neutral's file; normals are computed as the shapes' are."""
    message = "not read: {channels}"
    return [finding("CHANNEL_IGNORED", str(path), message, contents)] if contents else []


def _other_properties(mesh: trimesh.Trimesh) -> list[str]:
    """Return the properties and elements of a PLY file that are no points and faces."""
    found: list[str] = []
    for element, content in mesh.metadata.get("_ply_raw", {}).items():
        names = [str(name) for name in content.get("properties", {})]
        if element == "vertex":
            found += [name for name in names if name not in ("x", "y", "z")]
        elif element == "face":
            found += [name for name in names if name not in ("vertex_indices", "vertex_index")]
        else:
            found.append(f"element {element}")
    return found


def _read_points(path: Path, neutral: Mesh) -> tuple[FloatArray, bool]:
    """Return the points of a shape and whether its faces (if any) are the neutral's."""
    if path.suffix.lower() == ".ply":
        found, _ = _read_ply(path)
        points, faces = np.asarray(found.vertices, np.float64), np.ravel(found.faces)
        counts = np.full(len(found.faces), 3)
    else:
        obj = read_obj(path)
        points, counts, faces = obj.points, obj.face_counts, obj.face_indices
    return points, not len(faces) or _are_same(counts, faces, neutral)


def _are_same(counts: IntArray, faces: IntArray, neutral: Mesh) -> bool:
    """Return whether faces are those of the neutral, in any order and from any corner on."""
    if np.array_equal(faces, neutral.face_indices) and np.array_equal(counts, neutral.face_counts):
        return True
    one = _faces_by_size(counts, faces)
    other = _faces_by_size(neutral.face_counts, neutral.face_indices)
    return one.keys() == other.keys() and all(
        np.array_equal(one[size], other[size]) for size in one
    )


def _faces_by_size(counts: IntArray, faces: IntArray) -> dict[int, IntArray]:
    """Return sorted faces (N, size), each from its least corner on."""
    starts = np.cumsum(counts) - counts
    found = {}
    for size in np.unique(counts[counts > 0]).tolist():
        corners = starts[counts == size, None] + np.arange(size)
        rows = faces[corners]
        turned = (rows.argmin(axis=1)[:, None] + np.arange(size)) % size
        rows = np.take_along_axis(rows, turned, axis=1)
        found[size] = rows[np.lexsort(rows.T[::-1])]
    return found


def _read_ply(path: Path) -> tuple[trimesh.Trimesh, int]:
    """Return a PLY file's mesh, points in their own order, and its number of polygons."""
    try:
        with path.open("rb") as file:
            # Not processed: trimesh would merge and drop points.
            found = trimesh.load(file, file_type="ply", process=False)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}", "FILE_UNREADABLE") from error
    except Exception as error:  # trimesh lets any error of its parsers through
        raise InputError(
            f"{path} cannot be read as PLY: {error or type(error).__name__}; is it cut off, or "
            "binary with triangles and quads mixed? Then export triangles, ASCII or OBJ",
            "FILE_UNREADABLE",
        ) from error
    if not isinstance(found, trimesh.Trimesh) or not len(found.vertices):
        raise InputError(f"{path} holds no mesh; expected PLY points and faces", "FACE_MISSING")
    if not np.isfinite(found.vertices).all():
        raise InputError(
            f"{path}: points must be finite numbers; export the mesh again", "VALUES_WRONG"
        )
    raw = found.metadata.get("_ply_raw", {}).get("face", {})
    return found, int(raw.get("length", len(found.faces)))
