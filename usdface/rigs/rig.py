"""A character: meshes with blend shapes, a skeleton and materials."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from usdface.arguments import checked
from usdface.errors import InputError
from usdface.materials import Material
from usdface.rigs.face_mesh import face_of, faces_like
from usdface.rigs.mesh import Mesh
from usdface.rigs.skeleton import Skeleton
from usdface.scene import Camera, Extras, Group, Light
from usdface.short_repr import short_repr

__all__ = ["Rig"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Rig:
    """A character: meshes with blend shapes, maybe a skeleton, materials.

    Attributes
    ----------
    name : str
    meshes : tuple of Mesh
        Shapes of the same name on several meshes share one weight.
    skeleton : Skeleton or None
    materials : tuple of Material
    source : str
        File it was read from.
    cameras : tuple of Camera
    lights : tuple of Light
    extras, asset : mapping
        Custom data of users, of the scene and of the file.
    groups : tuple of Group
        Parents before children.
    joint_extras : mapping
        Custom data of users by path of the joint.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> rig.mesh("head").shape_names[:2] == rig.shape_names[:2]
    True
    """

    __repr__ = short_repr

    name: str
    meshes: tuple[Mesh, ...]
    skeleton: Skeleton | None = None
    materials: tuple[Material, ...] = field(default=())
    source: str = ""
    cameras: tuple[Camera, ...] = ()
    lights: tuple[Light, ...] = ()
    extras: Extras = field(default_factory=dict)
    asset: Extras = field(default_factory=dict)
    groups: tuple[Group, ...] = ()
    joint_extras: Mapping[str, Extras] = field(default_factory=dict)

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of all blend shapes, in order of first appearance."""
        return tuple(dict.fromkeys(n for mesh in self.meshes for n in mesh.shape_names))

    def face(self) -> Mesh:
        """Return the mesh that the most blend shapes move, or a larger one that they move, too.

        Lashes, teeth and a tongue carry a head's shapes, and may have some of their own: of the
        meshes with nearly all of those shapes it is the one of which they move the largest part.
        Clothes have other shapes.

        Raises
        ------
        InputError
            If no mesh has any.
        """
        return face_of(self.meshes, self.source or self.name)

    def mesh(self, name: str = "") -> Mesh:
        """Return the mesh of that name or path; without one, the face.

        Raises
        ------
        InputError
            If there is no such mesh, it has no blend shapes, or none was named and there are two
            faces.
        """
        if not name:
            return self._only_face()
        found = [m for m in self.meshes if name in (m.path, m.name)]
        if not found:
            known = ", ".join(m.path or m.name for m in self.meshes)
            raise InputError(
                f"the rig {self.name!r} has no mesh {name!r}, as the binding names it; it has "
                f'{known}; correct "mesh" of the binding, or give one that was made for this rig',
                "MESH_UNKNOWN",
            )
        if not found[0].shapes:
            raise InputError(
                f"mesh {name!r} of the rig {self.name!r} has no blend shapes; name the mesh of the "
                'face in the binding, "mesh"',
                "SHAPES_MISSING",
            )
        return found[0]

    def _only_face(self) -> Mesh:
        face = self.face()
        faces = faces_like(face, self.meshes)
        if len(faces) > 1:  # as of two characters in one scene
            known = ", ".join(mesh.path or mesh.name for mesh in faces)
            raise InputError(
                f"the rig {self.name!r} has {len(faces)} faces ({known}); name one as "
                '"mesh" in the binding',
                "MESH_UNKNOWN",
            )
        return face
