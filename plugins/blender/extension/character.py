"""The character: its meshes with shape keys, and its export as a rig."""

import string
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from .messages import FaceError

NOT_EXPORTED = (
    "{} is not in the export with its shape keys; export it, with Shape Keys and Armatures on"
)
NOT_SHOWN = (
    "Blender exports no shape keys of {}; show its collections, in the view layer and in renders, "
    "and let its shape keys be relative"
)
INTERNAL = {"exporting": False}  # the hook leaves exports alone that are ours
_FLAGS = ("hide_select", "hide_viewport", "hide_render")  # that keep an object from an export


def face_meshes(character: bpy.types.Object) -> list[bpy.types.Object]:
    """Return the meshes with shape keys of a character, the one with most of them first."""
    below = [character, *character.children_recursive]
    moved = [
        other
        for other in bpy.data.objects
        if any(m.type == "ARMATURE" and m.object == character for m in other.modifiers)
        and other.users_scene  # not deleted; Blender looks through all objects of all scenes
    ]
    found = {o.name: o for o in (*below, *moved) if o.type == "MESH" and key_names(o)}
    return sorted(found.values(), key=lambda o: -len(key_names(o)))


def key_names(mesh: bpy.types.Object) -> list[str]:
    """Return the names of the shape keys of a mesh, without its basis."""
    keys = mesh.data.shape_keys
    return [key.name for key in keys.key_blocks if key != keys.reference_key] if keys else []


def character_of(scene: bpy.types.Scene) -> bpy.types.Object:
    """Return the character that the panel names, or the only one of the scene.

    Raises
    ------
    FaceError
        If there is none, it has no shape keys or is not in the scene, or there are several.
    """
    character = scene.usdface.character
    if character is None:
        faces = {_root(o).name: o for o in scene.objects if o.type == "MESH" and key_names(o)}
        if len(faces) > 1:
            raise FaceError(
                f"the scene has {len(faces)} characters with shape keys "
                f"({', '.join(sorted(faces))}); choose one under Character"
            )
        if not faces:
            raise FaceError("no mesh of the scene has shape keys; choose a Character that has")
        character = next(_root(o) for o in faces.values())
    if scene not in character.users_scene:  # deleted, but held by the panel
        raise FaceError(f"{character.name} is not in the scene; choose another Character")
    if not face_meshes(character):
        raise FaceError(f"{character.name} has no shape keys, nor has any mesh below it")
    return character


def _root(mesh: bpy.types.Object) -> bpy.types.Object:
    """Return what a mesh belongs to: its outermost parent, or the armature that moves it."""
    top = mesh
    while top.parent is not None:
        top = top.parent
    armatures = [m.object for m in mesh.modifiers if m.type == "ARMATURE" and m.object]
    return armatures[0] if top is mesh and armatures else top


def usd_name(name: str) -> str:
    """Return the name of a prim that Blender makes of a name."""
    cleaned = "".join(c if f"a{c}".isidentifier() else "_" for c in name)
    if cleaned[:1] in string.digits:
        return f"_{cleaned}"
    return cleaned if cleaned[0].isidentifier() else f"_{cleaned[1:]}"


def export_character(character: bpy.types.Object, path: Path) -> None:
    """Export the character alone, at rest, without materials.

    Raises
    ------
    FaceError
        If Blender cannot export it, or exports two shape keys as one.
    """
    meshes = face_meshes(character)
    for mesh in meshes:
        _check_names(mesh)
    others = [m.object for o in meshes for m in o.modifiers if m.type == "ARMATURE" and m.object]
    options = {
        "export_animation": False,
        "export_armatures": True,
        "export_shapekeys": True,
        "export_materials": False,
        "export_uvmaps": False,
        "export_normals": False,
    }
    export_objects([*meshes, *others], path, options)


def _check_names(mesh: bpy.types.Object) -> None:
    """Refuse two shape keys with the same name in USD."""
    first: dict[str, str] = {}
    for name in key_names(mesh):
        other = first.setdefault(usd_name(name), name)
        if other != name:
            raise FaceError(
                f"the shape keys {other} and {name} of {mesh.name} have the same name in USD, "
                f"{usd_name(name)}; rename one"
            )


def export_objects(objects: list[bpy.types.Object], path: Path, options: dict) -> None:
    """Export some objects and what they are below; selection and hook stay as they are."""
    with _only(objects), _quietly():
        try:
            bpy.ops.wm.usd_export(
                filepath=str(path),
                selected_objects_only=True,
                export_custom_properties=True,
                allow_unicode=True,  # in 4.5 off: まばたき would be ____
                **options,
            )
        except RuntimeError as error:
            raise FaceError(f"Blender cannot export {path.name}: {error}") from error
    if not path.exists():
        raise FaceError(f"Blender wrote no {path}")


@contextmanager
def _only(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Select these objects alone, for a while, whether they are hidden or may not be selected."""
    layer = bpy.context.view_layer
    before, active = [o for o in layer.objects if o.select_get()], layer.objects.active
    there = set(layer.objects)
    flagged = [(o, flag) for o in objects for flag in _FLAGS if getattr(o, flag)]
    hidden = [o for o in objects if o in there and o.hide_get()]
    try:
        for item, flag in flagged:
            setattr(item, flag, False)
        layer.update()
        for item in hidden:
            item.hide_set(False)
        for item in layer.objects:
            item.select_set(item in objects)
        yield
    finally:
        for item in hidden:
            item.hide_set(True)
        for item in layer.objects:
            item.select_set(item in before)
        layer.objects.active = active
        for item, flag in flagged:
            setattr(item, flag, True)


@contextmanager
def _quietly() -> Iterator[None]:
    INTERNAL["exporting"] = True
    try:
        yield
    finally:
        INTERNAL["exporting"] = False
