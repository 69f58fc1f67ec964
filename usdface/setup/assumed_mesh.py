"""The mesh of given vertices, where none is named."""

from usdface.findings import Finding, finding
from usdface.rigs import Mesh, Rig
from usdface.setup.binding import Binding

__all__ = ["assumed_mesh", "assumed_mesh_findings", "is_mesh_assumed"]


def is_mesh_assumed(character: Rig, binding: Binding) -> bool:
    """Return whether vertices are given of a mesh without a name, among several with shapes."""
    several = sum(bool(mesh.shapes) for mesh in character.meshes) > 1
    return several and bool(binding.markers) and not binding.mesh


def assumed_mesh_findings(
    character: Rig, binding: Binding, where: str, shot: bool = False
) -> list[Finding]:
    """Return the finding that the mesh of a binding, or of a `shot`, is assumed; [] if it is not.

    Raises
    ------
    InputError
        If several meshes of the character could be the face.
    """
    if not is_mesh_assumed(character, binding):
        return []
    return [assumed_mesh(character.mesh(), where, shot)]


def assumed_mesh(mesh: Mesh, where: str, shot: bool = False) -> Finding:
    """Return the finding that vertices are taken as those of a mesh, of a binding or a `shot`."""
    message = (
        'the binding names no mesh; its vertices are taken as those of {mesh}; "mesh" in the '
        "binding names another one"
    )
    if shot:
        message = (
            "the binding names no mesh; its vertices are taken as those of {mesh}; the "
            "relationship usdface:bind:mesh names another one"
        )
    return finding("MESH_ASSUMED", where, message, mesh.path or mesh.name)
