"""MakeHuman's base mesh and targets as a rig."""

from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.rigs.formats import mesh_files
from usdface.io.rigs.obj import ObjMesh, read_obj
from usdface.options import RigOptions
from usdface.rigs import BlendShape, Mesh, Rig

__all__ = ["is_makehuman", "makehuman_files", "read_makehuman", "target_files"]

_METERS_PER_UNIT = 0.1  # "Asset format: targets"; of the base mesh and the targets alike
_BODY = "body"


def is_makehuman(folder: Path) -> bool:
    """Return whether `folder` has targets, and `base.obj` there or above, or one mesh at most.

    Without `base.obj` a mesh may be the base under another name, or missing; both are said where
    the folder is read. Several meshes are a folder of shapes.
    """
    if _base(folder) is None and len(mesh_files(folder)) > 1:
        return False
    return bool(target_files(folder)[1])


def makehuman_files(folder: Path) -> list[Path]:
    """Return the files that may be read for `folder`: meshes, `base.obj` above it, targets."""
    base = _base(folder)
    meshes = mesh_files(folder)
    return [*meshes, *([base] if base and base not in meshes else []), *target_files(folder)[1]]


def read_makehuman(folder: Path, options: RigOptions = RigOptions()) -> tuple[Rig, list[Finding]]:
    """Read `base.obj` and all `.target` files as one mesh with blend shapes.

    `folder` holds `base.obj` and `targets/`, or is the folder of targets with `base.obj` one
    level up; `options.neutral` names another base mesh, an OBJ in `folder`. A target's name is
    its path in the folder of targets, without the suffix. Only the faces of the group `body` are
    kept: the others are helpers for clothes and joints. One unit is a decimetre unless
    `options.meters_per_unit` says otherwise; Y is up.

    Raises
    ------
    InputError
        If there are no targets or no base mesh, or one cannot be read.

    References
    ----------
    MakeHuman, "Asset format: targets": a line is a vertex index from 0 and three offsets;
    one unit is a decimetre, Y up.
    """
    place, files = target_files(folder)
    if not files:
        raise InputError(
            f"{folder} has no MakeHuman .target files; name the folder that has them",
            "SHAPES_MISSING",
        )
    base = _chosen_base(folder, len(files), options.neutral)
    unit = _METERS_PER_UNIT if options.meters_per_unit is None else options.meters_per_unit
    obj = read_obj(base)
    mesh, kept, findings = _body(obj, base, unit)
    if unread := [*obj.unread, *(["materials"] if any(obj.materials) else [])]:
        findings.append(finding("CHANNEL_IGNORED", str(base), "not read: {channels}", unread))
    place_of = np.full(len(obj.points), -1, np.int64)
    place_of[kept] = np.arange(len(kept))
    shapes: list[BlendShape] = []
    for path in files:
        name = path.relative_to(place).with_suffix("").as_posix()
        indices, offsets = _read_target(path, len(obj.points))
        dense = np.zeros((len(kept), 3))
        on_body = place_of[indices] >= 0
        dense[place_of[indices[on_body]]] = offsets[on_body] * unit
        shapes.append(BlendShape.from_dense(name, dense))
        if not len(shapes[-1].indices):
            findings.append(finding("SHAPE_EMPTY", str(path)))
    whole = Mesh(
        mesh.name, mesh.points, mesh.face_counts, mesh.face_indices, None, mesh.uvs, tuple(shapes)
    )
    return Rig(folder.resolve().name, (whole,), None, (), str(folder)), findings


def target_files(folder: Path) -> tuple[Path, list[Path]]:
    """Return the folder of targets in `folder`, or itself, and the `.target` files below that."""
    inner = folder / "targets"
    place = inner if inner.is_dir() else folder
    return place, sorted(p for p in place.rglob("*.target") if not p.name.startswith("."))


def _base(folder: Path) -> Path | None:
    places = (folder / "base.obj", folder.resolve().parent / "base.obj")
    return next((path for path in places if path.is_file()), None)


def _chosen_base(folder: Path, target_count: int, wanted: str) -> Path:
    """Return the mesh that the targets move."""
    base = _base(folder)
    meshes = {path for path in mesh_files(folder) if path.suffix.lower() == ".obj"}
    meshes |= {base} if base else set()
    if wanted:
        base = next((path for path in sorted(meshes) if wanted in (path.name, path.stem)), None)
        missing = f"no OBJ mesh {wanted!r}"
    else:
        missing = "no base mesh: base.obj is neither there nor in the folder above it"
    if base is not None:
        return base
    names = ", ".join(sorted(path.name for path in meshes))
    remedy = f"name it with --neutral: {names}" if names else "add MakeHuman's base.obj"
    raise InputError(
        f"{folder} has {target_count} MakeHuman .target files but {missing}; {remedy}",
        "NEUTRAL_UNKNOWN",
    )


def _body(obj: ObjMesh, path: Path, unit: float) -> tuple[Mesh, IntArray, list[Finding]]:
    """Return the body alone [m] and which points of the file it keeps: (V,) int64."""
    on_body = np.array([group == _BODY for group in obj.groups], bool)
    if not on_body.any():
        on_body[:] = True  # not the base mesh as published: helpers are not marked
    corners = np.repeat(on_body, obj.face_counts)
    kept, indices = np.unique(obj.face_indices[corners], return_inverse=True)
    mesh = Mesh(
        _BODY,
        obj.points[kept] * unit,
        obj.face_counts[on_body],
        indices.ravel(),
        None,
        None if obj.uvs is None else obj.uvs[corners],
    )
    lost = len(obj.points) - len(kept)
    if not lost:
        return mesh, kept, []
    message = "{face_count} faces and {point_count} points of helper geometry are left out"
    return (
        mesh,
        kept,
        [
            finding(
                "HELPERS_DROPPED",
                str(path),
                message,
                (~on_body).sum(),
                lost,
            )
        ],
    )


def _read_target(path: Path, count: int) -> tuple[IntArray, FloatArray]:
    try:
        lines = path.read_text("utf-8-sig", "replace").splitlines()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}", "FILE_UNREADABLE") from error
    rows = [line.split() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    try:
        table = np.array(rows, np.float64).reshape(len(rows), 4)
    except ValueError as error:
        raise InputError(
            f"{path}: a line does not hold an index and three offsets; "
            "expected e.g. `12 0.1 0 -0.2`",
            "ROW_WRONG",
        ) from error
    if not np.isfinite(table).all():
        raise InputError(
            f"{path}: an offset is not a finite number; export the target again", "VALUES_WRONG"
        )
    if len(table) and not 0 <= table[:, 0].min() <= table[:, 0].max() < count:
        raise InputError(
            f"{path}: a vertex index is outside 0 to {count - 1} of the base mesh; "
            "is it a target of another mesh?",
            "POINT_INDICES_OUTSIDE",
        )
    return table[:, 0].astype(np.int64), table[:, 1:]
