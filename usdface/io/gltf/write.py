"""A rig and a take to glTF 2.0."""

from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pygltflib

from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import BufferBuilder
from usdface.io.gltf.document import save_document
from usdface.io.gltf.inbetweens import crossings, flat_weights
from usdface.io.gltf.materials import write_materials
from usdface.io.gltf.nodes import compose, decompose
from usdface.io.gltf.write_mesh import written_mesh
from usdface.rigs import Mesh, Rig, Skeleton
from usdface.takes import FloatArray, WeightsTake

__all__ = ["write_gltf"]


def write_gltf(rig: Rig, path: Path, weights: WeightsTake | None = None) -> list[Finding]:
    """Write a rig, and a take that moves its blend shapes, as .glb or .gltf with a .bin.

    Every mesh becomes one node with one glTF mesh (`usdface.io.gltf.write_mesh`); blend
    shapes become morph targets named by ``mesh.extras.targetNames``. The take becomes one
    LINEAR animation, a channel for each mesh that it moves, all on the same times, with keys
    inserted where a weight passes an inbetween (`usdface.io.gltf.inbetweens`). The
    skeleton becomes nodes and one skin, unless it is a single joint that stands where it
    was bound: that moves nothing, and would only cost bytes and a skinning pass.

    Parameters
    ----------
    rig : Rig
    path : Path
        Ends in .glb or .gltf.
    weights : WeightsTake, optional
        A blend shape that it does not name stays at 0. Times below 0 are moved to start
        at 0; keys closer than float32 resolves are one unit in the last place apart.

    Returns
    -------
    list of Finding

    Raises
    ------
    OutputError
        If a number does not fit glTF or a file cannot be written; what was at `path`
        before is still there.

    Notes
    -----
    Source: glTF 2.0 specification, sections 3.5 (scenes), 3.7 (meshes, skins), 3.11
    (animations). Equal input gives equal bytes.
    """
    builder = BufferBuilder()
    materials, found = write_materials(rig.materials, builder, path)
    by_name = {material.name: material for material in materials.materials}
    document = pygltflib.GLTF2(
        asset=pygltflib.Asset(generator=f"usdface {_version()}"),
        materials=list(materials.materials),
        textures=list(materials.textures),
        images=list(materials.images),
        scene=0,
    )
    skeleton = _moving(rig)
    roots: list[int] = []
    carriers: list[tuple[int, Mesh]] = []
    for mesh in rig.meshes:
        made, news = written_mesh(mesh, by_name, builder, len(skeleton.joints) if skeleton else 0)
        found += news
        if made is None:
            continue
        skinned = skeleton is not None and mesh.skin is not None
        roots.append(len(document.nodes))
        carriers.append((len(document.nodes), mesh))
        document.nodes.append(
            pygltflib.Node(name=mesh.name, mesh=len(document.meshes), skin=0 if skinned else None)
        )
        document.meshes.append(made)
    if skeleton is not None:
        roots += _write_skeleton(skeleton, document, builder, found)
    if weights is not None:
        found += _write_weights(weights, carriers, document, builder)
    document.scenes = [pygltflib.Scene(name=rig.name, nodes=roots)]
    document.accessors, document.bufferViews = builder.accessors, builder.views
    save_document(document, builder.blob, materials.beside, path)
    return found


def _version() -> str:
    try:
        return version("usdface")
    except PackageNotFoundError:  # run from a source tree that was never installed
        return "(source)"


def _moving(rig: Rig) -> Skeleton | None:
    """Return the rig's skeleton if it can change what is seen."""
    skeleton = rig.skeleton
    if skeleton is None or not any(mesh.skin is not None for mesh in rig.meshes):
        return None
    trivial = len(skeleton.joints) == 1 and np.allclose(skeleton.bind, skeleton.rest, atol=1e-9)
    return None if trivial else skeleton


def _write_skeleton(
    skeleton: Skeleton, document: pygltflib.GLTF2, builder: BufferBuilder, found: list[Finding]
) -> list[int]:
    """Append a node for each joint and the skin; return the nodes without a parent."""
    start = len(document.nodes)
    place = {path: start + k for k, path in enumerate(skeleton.joints)}
    roots = []
    for path, name, rest in zip(skeleton.joints, skeleton.names, skeleton.rest, strict=True):
        translation, rotation, scale = decompose(rest)
        if not np.allclose(compose(translation, rotation, scale), rest, atol=1e-5):
            message = "the shear of a joint's rest transform is left out"
            found.append(finding("FEATURE_DROPPED", path, message))
        document.nodes.append(
            pygltflib.Node(
                name=name,
                translation=translation.tolist(),
                rotation=rotation.tolist(),
                scale=scale.tolist(),
            )
        )
        parent = place.get(path.rpartition("/")[0])
        if parent is None:
            roots.append(place[path])
        else:
            document.nodes[parent].children.append(place[path])
    inverse = np.linalg.inv(skeleton.bind)
    inverse[:, :, 3] = (0, 0, 0, 1)  # to the last bit, as the specification wants
    document.skins = [
        pygltflib.Skin(
            joints=list(place.values()),
            inverseBindMatrices=builder.array(inverse.reshape(-1, 16)),
        )
    ]
    return roots


def _write_weights(
    take: WeightsTake,
    carriers: Sequence[tuple[int, Mesh]],
    document: pygltflib.GLTF2,
    builder: BufferBuilder,
) -> list[Finding]:
    found = []
    known = {name for _, mesh in carriers for name in mesh.shape_names}
    for name in take.names:
        if name not in known:
            found.append(finding("SHAPE_UNKNOWN", name, "no mesh has it; its curve is left out"))
    moved = [(n, m) for n, m in carriers if not set(take.names).isdisjoint(m.shape_names)]
    if not moved:
        return found
    times, shift = _times(take.times)
    keys = WeightsTake(take.names, times, take.weights)
    if shift:
        message = f"glTF has no times below 0; all are {shift:g} s later"
        found.append(finding("FEATURE_DROPPED", take.source or "weights take", message))
    passed = [crossings(m, times, keys.reordered(m.shape_names).weights) for _, m in moved]
    moments = np.unique(np.concatenate([times, *passed]).astype(np.float32)).astype(np.float64)
    clock = builder.array(moments[:, None], bounds=True)
    animation = pygltflib.Animation(name=Path(take.source).stem or "weights")
    inserted = np.flatnonzero(~np.isin(moments, times))
    if len(inserted):
        animation.extras = {"usdface": {"insertedKeys": inserted.tolist()}}
    for number, (node, mesh) in enumerate(moved):
        own = keys.reordered(mesh.shape_names).weights
        values = flat_weights(mesh, _at(moments, times, own))
        animation.samplers.append(
            pygltflib.AnimationSampler(input=clock, output=builder.array(values.reshape(-1, 1)))
        )
        target = pygltflib.AnimationChannelTarget(node=node, path=pygltflib.WEIGHTS)
        animation.channels.append(pygltflib.AnimationChannel(sampler=number, target=target))
    document.animations = [animation]
    return found


def _at(moments: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    if len(moments) == len(times):
        return values
    return np.stack([np.interp(moments, times, column) for column in values.T], 1)


def _times(times: FloatArray) -> tuple[FloatArray, float]:
    """Return times that stay distinct as float32, and by how much they are later [s]."""
    shift = max(0.0, -float(times[0]))
    single = (times + shift).astype(np.float32)
    # The bit patterns of non-negative floats count upwards like the floats.
    steps = np.arange(len(single))
    bits = np.maximum.accumulate(single.view(np.int32).astype(np.int64) - steps) + steps
    return bits.astype(np.int32).view(np.float32).astype(np.float64), shift
