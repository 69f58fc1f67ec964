"""Names of blend shapes that were made unique over the meshes of a face, and their own ones.

Blender's USD counts through the names of all meshes of a skeleton: ``jawOpen`` on the first one by
name, ``jawOpen2`` on the second. Often the brows come before the head, whose names then mean no
movement any more; the prims keep the own names, which are the labels of the shapes. Our reader of
glTF writes ``teeth:jawOpen`` where an animation moves the teeth otherwise than the head.
"""

import re
from collections.abc import Mapping
from dataclasses import replace

from usdface.face.shape_aliases import is_counted
from usdface.findings import Finding, finding
from usdface.rigs import Mesh, Rig

__all__ = ["report_counted_names", "with_own_names"]


def with_own_names(rig: Rig) -> tuple[Rig, Mapping[str, Mapping[str, str]]]:
    """Return a rig that stands still with the own names of its blend shapes.

    One name is one weight: the meshes of a face move together again.

    Returns
    -------
    Rig
    mapping of str to mapping of str to str
        For each mesh that had others, by its path or name: own names by those.
    """
    changed = {mesh: own for mesh in rig.meshes if (own := _own_names(mesh, rig))}
    meshes = (_renamed(mesh, changed.get(mesh, {})) for mesh in rig.meshes)
    named = {mesh.path or mesh.name: own for mesh, own in changed.items()}
    return replace(rig, meshes=tuple(meshes)), named


def report_counted_names(rig: Rig) -> list[Finding]:
    """Return SHAPE_NAMES_COUNTED where a rig that is kept as it is has such names on its face."""
    if not rig.shape_names:
        return []
    face = rig.face()
    own = {name: label for name, label in _own_names(face, rig).items() if is_counted(name, label)}
    if not own:
        return []
    message = (
        "an exporter made names unique by numbers, by which they are not known: {shapes} for "
        "{names}; `usdface rig` writes a rig with the own names"
    )
    return [finding("SHAPE_NAMES_COUNTED", face.path, message, list(own), list(own.values()))]


def _own_names(mesh: Mesh, rig: Rig) -> Mapping[str, str]:
    """Return the own names of shapes whose names were made unique, which other meshes have."""
    others = {*rig.shape_names} - {*mesh.shape_names}
    return {
        shape.name: shape.label
        for shape in mesh.shapes
        if shape.label in others
        and (is_counted(shape.name, shape.label) or _is_prefixed(shape.name, shape.label))
    }


def _is_prefixed(name: str, own: str) -> bool:
    return bool(re.fullmatch(rf".+:{re.escape(own)}(_\d+)?", name, re.DOTALL))


def _renamed(mesh: Mesh, own: Mapping[str, str]) -> Mesh:
    if not own:
        return mesh
    shapes = (replace(s, name=own[s.name], label="") if s.name in own else s for s in mesh.shapes)
    return replace(mesh, shapes=tuple(shapes))
