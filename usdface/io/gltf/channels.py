"""Targets of animation channels: those of the core, and KHR_animation_pointer.

Source: glTF 2.0 specification, section 3.11 (animations); KHR_animation_pointer and the glTF
2.0 asset object model for the pointers.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pygltflib import GLTF2, Animation, AnimationSampler

from usdface.errors import InputError
from usdface.io.gltf.document import item

__all__ = ["POINTER", "Channel", "channels_of", "pointer_to"]

POINTER = "KHR_animation_pointer"
_TRANSFORMS = ("translation", "rotation", "scale")
_PLACE = re.compile(
    r"/(nodes|meshes)/(0|[1-9][0-9]{0,8})"
    r"/(weights|translation|rotation|scale)(?:/(0|[1-9][0-9]{0,8}))?"
)


@dataclass(frozen=True, slots=True)
class Channel:
    """A sampler that moves `path` of a node: weights, translation, rotation or scale.

    `column` is the one weight that it moves, None for all. `pointer` tells the extension's
    channels from those of the core.
    """

    node: int
    path: str
    column: int | None
    sampler: AnimationSampler
    pointer: bool = False


def channels_of(
    document: GLTF2, node_weights: Sequence[object], animation: Animation
) -> tuple[list[Channel], list[str]]:
    """Return the channels of an animation that move nodes, and the unsupported targets.

    The weights of a mesh are those of all nodes that carry it and have none of their own.

    Raises
    ------
    InputError
        If a channel names a node, mesh or sampler that does not exist, or two channels move
        the same.
    """
    known: list[Channel] = []
    unknown: list[str] = []
    for channel in animation.channels or []:
        sampler = item(animation.samplers or [], channel.sampler, "animation sampler")
        target = channel.target
        if target is None:
            continue
        if target.path == "pointer":
            pointer = _pointer(target.extensions)
            nodes, path, column = _resolved(pointer, document, node_weights)
            known += [Channel(node, path, column, sampler, True) for node in nodes]
            unknown += [] if nodes else [pointer]
        elif target.node is not None:
            item(document.nodes or [], target.node, "node")
            if target.path in (*_TRANSFORMS, "weights"):
                known.append(Channel(target.node, target.path, None, sampler))
            else:
                unknown.append(str(target.path))
    taken = set()
    for one in known:
        key = (one.node, one.path, one.column, one.pointer)
        if key in taken:
            raise InputError(
                f"{animation.name or 'an animation'!r} moves the {one.path} of one node twice"
            )
        taken.add(key)
    return known, unknown


def pointer_to(node: int, column: int) -> str:
    """Return the pointer to one weight of a node."""
    return f"/nodes/{node}/weights/{column}"


def _pointer(extensions: object) -> str:
    ours = extensions.get(POINTER) if isinstance(extensions, Mapping) else None
    pointer = ours.get("pointer") if isinstance(ours, Mapping) else None
    if not isinstance(pointer, str):
        raise InputError(f"an animation channel has the path 'pointer' but no {POINTER}")
    return pointer


def _resolved(
    pointer: str, document: GLTF2, node_weights: Sequence[object]
) -> tuple[list[int], str, int | None]:
    found = _PLACE.fullmatch(pointer)
    if found is None or (found[4] is not None and found[3] != "weights"):
        return [], "", None
    index, path = int(found[2]), found[3]
    column = None if found[4] is None else int(found[4])
    if found[1] == "nodes":
        item(document.nodes or [], index, "node")
        return [index], path, column
    item(document.meshes or [], index, "mesh")
    carriers = [
        n
        for n, node in enumerate(document.nodes or [])
        if node.mesh == index and not node_weights[n]
    ]
    return (carriers if path == "weights" else []), path, column
