"""Checks of the morph targets of a glTF file.

One function for one rule, severities as in `usdface.io.usd.check`. Names are a convention
of glTF (`mesh.extras.targetNames`) that the Khronos validator does not look at: without them
files still play, so missing names are a *warning*; a list of the wrong length gives shapes
wrong names and is an *error*.

Source: glTF 2.0 specification, sections 3.7.2.2 (morph targets) and 3.11 (animations).
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.stray_points import stray_move, stray_point
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.decompress import decompress
from usdface.io.gltf.document import GltfFile, item, load_document

__all__ = ["check_gltf"]

_ROUNDING = 1e-5  # rounding of exporters, beyond weights of 0 and 1
Findings = Iterator[Finding]


@dataclass(frozen=True, eq=False, slots=True)
class _Mesh:
    """One mesh and the number of morph targets that its first primitive announces."""

    where: str
    mesh: Any
    targets: int
    reader: AccessorReader
    node_extras: tuple[Any, ...] = ()


def check_gltf(path: Path) -> list[Finding]:
    """Check the morph targets of a .glb or .gltf.

    Raises
    ------
    InputError
        If the file is not glTF 2.0, a buffer is missing, or it breaks the schema.
    """
    findings: list[Finding] = []
    try:
        file = decompress(load_document(path))
        for mesh in _meshes(file):
            for rule in _MESH_RULES:
                findings += rule(mesh)
        findings += _node_weights_fit(file)
        findings += _animations_fit(file)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"the JSON does not follow the glTF schema: {error}", "SCHEMA_BROKEN"
        ) from error
    return findings


def _meshes(file: GltfFile) -> Iterator[_Mesh]:
    reader = AccessorReader(file)
    extras: defaultdict[Any, list[Any]] = defaultdict(list)
    for node in file.document.nodes or []:
        extras[node.mesh].append(node.extras)
    for index, mesh in enumerate(file.document.meshes or []):
        label = f"mesh {index} {mesh.name!r}" if mesh.name else f"mesh {index}"
        yield _Mesh(label, mesh, _target_count(mesh), reader, tuple(extras[index]))


def _target_count(mesh: Any) -> int:
    return len(mesh.primitives[0].targets or []) if mesh.primitives else 0


def _names_are_there(of: _Mesh) -> Findings:
    names = (of.mesh.extras or {}).get("targetNames")
    if names is None and of.targets:
        message = "there is no extras.targetNames"
        elsewhere = (*(p.extras for p in of.mesh.primitives), *of.node_extras)
        if any(isinstance(e, Mapping) and "targetNames" in e for e in elsewhere):
            message += " on the mesh, where programs look for it, but on a node or primitive"
        yield finding("SHAPE_NAMES_MISSING", of.where, message)
    elif names is not None and len(names) != of.targets:
        message = "{name_count} targetNames for {shape_count} morph targets"
        yield finding("SHAPE_NAMES_MISMATCH", of.where, message, len(names), of.targets)


def _names_are_unique(of: _Mesh) -> Findings:
    names = [str(name) for name in (of.mesh.extras or {}).get("targetNames") or ()]
    for name in sorted({n for n in names if names.count(n) > 1}):
        message = "the name {shape!r} occurs {name_count} times in targetNames"
        yield finding("SHAPE_NAME_REPEATED", of.where, message, name, names.count(name))


def _primitives_agree(of: _Mesh) -> Findings:
    for index, primitive in enumerate(of.mesh.primitives):
        count = len(primitive.targets or [])
        if count != of.targets:
            message = (
                "primitive {primitive} has {shape_count} morph targets, primitive 0 has "
                "{expected_count}"
            )
            yield finding("TARGETS_UNEQUAL", of.where, message, index, count, of.targets)


def _mesh_weights_fit(of: _Mesh) -> Findings:
    if of.mesh.weights:
        yield from _weights_fit(of.where, np.array(of.mesh.weights, np.float64), of.targets)


def _targets_can_be_read(of: _Mesh) -> Findings:
    for number, primitive in enumerate(of.mesh.primitives):
        attributes = vars(primitive.attributes)
        for place, target in enumerate(primitive.targets or []):
            where = f"{of.where}, primitive {number}, target {place}"
            for name, accessor in target.items():
                base = attributes.get(name)
                if base is None:
                    message = "{attribute} is morphed, but the primitive has no {attribute}"
                    yield finding("VALUES_WRONG", where, message, name)
                    continue
                try:
                    if name.startswith(("COLOR_", "TEXCOORD_")):
                        _read_attribute(of.reader, name, accessor, of.reader.count(base))
                    else:
                        of.reader.offsets(accessor, of.reader.count(base))
                except InputError as error:
                    yield finding("VALUES_WRONG", where, "{attribute}: {error}", name, error)


def _read_attribute(reader: AccessorReader, name: str, accessor: object, count: int) -> None:
    """Read the change of colours or texture coordinates by a morph target (section 3.7.2.2)."""
    kinds = ("VEC2",) if name.startswith("TEXCOORD_") else ("VEC3", "VEC4")
    values = reader.floats(accessor, reader.kind(accessor, kinds))
    if len(values) != count:
        raise InputError(f"{len(values)} elements for {count} vertices", "TARGETS_UNEQUAL")


def _targets_move_something(of: _Mesh) -> Findings:
    for place in range(of.targets):
        targets = [p.targets[place] for p in of.mesh.primitives if len(p.targets or []) > place]
        if not any(_moves(of.reader, target) for target in targets):
            yield finding("SHAPE_EMPTY", f"{of.where}, target {place}")


def _points_are_near(of: _Mesh) -> Findings:
    places = dict.fromkeys(p.attributes.POSITION for p in of.mesh.primitives)
    points = {place: _points(of.reader, place) for place in places}
    whole = np.concatenate([np.zeros((0, 3)), *points.values()])
    for number, primitive in enumerate(of.mesh.primitives):
        where = f"{of.where}, primitive {number}"
        own = points[primitive.attributes.POSITION]
        stray = stray_point(own)
        if stray:
            yield finding("POINT_STRAY", where, *stray)
        for place, target in enumerate(primitive.targets or []):
            if not (len(own) and target.get("POSITION") is not None):
                continue
            try:
                indices, offsets = of.reader.offsets(target["POSITION"], len(own))
            except InputError:
                continue  # reported already
            stray = stray_move(offsets, indices, whole)
            if stray:
                yield finding("POINT_STRAY", f"{where}, target {place}", *stray)


def _points(reader: AccessorReader, accessor: object) -> FloatArray:
    """Return the points of an accessor; none if unreadable, which is reported elsewhere."""
    try:
        return reader.floats(accessor, "VEC3")
    except InputError:
        return np.zeros((0, 3))


def _normals_follow(of: _Mesh) -> Findings:
    for number, primitive in enumerate(of.mesh.primitives):
        if primitive.attributes.NORMAL is None:
            continue  # flat, and made from the points that are shown (section 3.7.2.1)
        without = [place for place, t in enumerate(primitive.targets or []) if "NORMAL" not in t]
        if without:
            where = f"{of.where}, primitive {number}"
            more = Prose(f" and {len(without) - 1} more" if without[1:] else "")
            message = "target {target}{more} morphs no NORMAL"
            count = len(without)
            yield finding("NORMALS_MISSING", where, message, without[0], more, target_count=count)


def _bounds_are_there(of: _Mesh) -> Findings:
    accessors = of.reader.file.document.accessors or []
    for number, primitive in enumerate(of.mesh.primitives):
        parts = [vars(primitive.attributes), *(primitive.targets or [])]
        places = [part["POSITION"] for part in parts if part.get("POSITION") is not None]
        bare = [k for k in places if k < len(accessors) and not accessors[k].min]
        if bare:
            where = f"{of.where}, primitive {number}"
            yield finding(
                "BOUNDS_MISSING", where, "POSITION accessor {accessor} has no min, max", bare[0]
            )


def _moves(reader: AccessorReader, target: dict[str, Any]) -> bool:
    for name, accessor in target.items():
        try:
            if name.startswith(("COLOR_", "TEXCOORD_")):
                kind = reader.kind(accessor, ("VEC2", "VEC3", "VEC4"))
                changes = reader.floats(accessor, kind)
            else:
                _, changes = reader.offsets(accessor, reader.count(accessor))
            if changes.any():
                return True
        except InputError:
            return True  # reported already: unreadable targets are not empty
    return False


_MESH_RULES: tuple[Callable[[_Mesh], Findings], ...] = (
    _names_are_there,
    _names_are_unique,
    _primitives_agree,
    _mesh_weights_fit,
    _targets_can_be_read,
    _targets_move_something,
    _points_are_near,
    _normals_follow,
    _bounds_are_there,
)


def _weights_fit(where: str, weights: FloatArray, count: int) -> Findings:
    if weights.shape != (count,):
        message = "{weight_count} weights for {shape_count} morph targets"
        yield finding("WEIGHTS_LENGTH_WRONG", where, message, weights.size, count)
    if (abs(weights - 0.5) > 0.5 + _ROUNDING).any():
        yield finding("WEIGHTS_OUT_OF_RANGE", where)


def _targets_of_node(file: GltfFile, node: object) -> int:
    mesh = item(file.document.nodes or [], node, "node").mesh
    return 0 if mesh is None else _target_count(item(file.document.meshes or [], mesh, "mesh"))


def _node_weights_fit(file: GltfFile) -> Findings:
    for node, weights in enumerate(file.node_weights):
        if weights is not None:
            values = np.array(weights, np.float64)
            yield from _weights_fit(f"node {node}", values, _targets_of_node(file, node))


def _animations_fit(file: GltfFile) -> Findings:
    for number, animation in enumerate(file.document.animations or []):
        for place, channel in enumerate(animation.channels):
            if channel.target.path == "weights" and channel.target.node is not None:
                where = f"animation {number}, channel {place}"
                try:
                    yield from _channel_fits(file, where, animation.samplers, channel)
                except InputError as error:
                    yield finding("VALUES_WRONG", where, "{error}", error)


def _channel_fits(file: GltfFile, where: str, samplers: list[Any], channel: Any) -> Findings:
    count = _targets_of_node(file, channel.target.node)
    if not count:
        message = "weights of node {node}, which has no morph targets"
        yield finding("WEIGHTS_LENGTH_WRONG", where, message, channel.target.node)
        return
    reader = AccessorReader(file)
    sampler = item(samplers, channel.sampler, "sampler")
    times = reader.floats(sampler.input, "SCALAR")[:, 0]
    weights = reader.floats(sampler.output, "SCALAR")[:, 0]
    parts = 3 if sampler.interpolation == "CUBICSPLINE" else 1
    yield from _curve_fits(where, times, weights, count, parts)


def _curve_fits(
    where: str, times: FloatArray, weights: FloatArray, count: int, parts: int
) -> Findings:
    """`parts` values for each key and target: 3 for cubic curves, whose middle is the weight."""
    if times[0] < 0 or (np.diff(times) <= 0).any():
        message = "times are not increasing from 0 or later"
        yield finding("VALUES_WRONG", where, message)
    if len(weights) != len(times) * count * parts:
        message = "{weight_count} numbers for {key_count} keys of {shape_count} morph targets"
        yield finding("WEIGHTS_LENGTH_WRONG", where, message, len(weights), len(times), count)
        return
    values = weights.reshape(len(times), parts, count)[:, parts // 2]
    if (abs(values - 0.5) > 0.5 + _ROUNDING).any():
        yield finding("WEIGHTS_OUT_OF_RANGE", where)
