"""Names of blend shapes that an exporter counted through over the meshes of a skeleton.

Blender's USD has ``jawOpen`` on the first mesh by name, ``jawOpen2`` on the second: often the brows
come before the head, whose names then mean no movement any more. The prims have the own names,
which are the labels of the shapes that are read (`usdface.io.usd.blend_shapes`).
"""

from collections.abc import Mapping
from dataclasses import replace

from usdface.face.shape_aliases import is_counted
from usdface.findings import Finding, finding
from usdface.rigs import Mesh, Rig

__all__ = ["report_counted_names", "with_own_names"]


def with_own_names(rig: Rig) -> tuple[Rig, list[Finding]]:
    """Return a rig that stands still with the own names of its blend shapes.

    One name is one weight: the meshes of a face move together again.
    """
    meshes, found = [], []
    for mesh in rig.meshes:
        own = _own_names(mesh, rig)
        if own:
            shapes = (
                replace(s, name=own[s.name], label="") if s.name in own else s for s in mesh.shapes
            )
            mesh = replace(mesh, shapes=tuple(shapes))
            message = "an exporter made names unique by numbers, which are left out: {shapes}"
            found.append(finding("NAME_CHANGED", mesh.path, message, list(own)))
        meshes.append(mesh)
    return replace(rig, meshes=tuple(meshes)), found


def report_counted_names(rig: Rig) -> list[Finding]:
    """Return SHAPE_NAMES_COUNTED where a rig that is kept as it is has such names on its face."""
    if not rig.shape_names:
        return []
    face = rig.face()
    own = _own_names(face, rig)
    if not own:
        return []
    message = (
        "an exporter made names unique by numbers, by which they are not known: {shapes} for "
        "{names}; `usdface rig` writes a rig with the own names"
    )
    return [finding("SHAPE_NAMES_COUNTED", face.path, message, list(own), list(own.values()))]


def _own_names(mesh: Mesh, rig: Rig) -> Mapping[str, str]:
    """Return the own names of the shapes of a mesh that are counted through, by their names."""
    taken = {*mesh.shape_names}
    known = {*rig.shape_names}
    return {
        shape.name: shape.label
        for shape in mesh.shapes
        if is_counted(shape.name, shape.label) and shape.label in known - taken
    }
