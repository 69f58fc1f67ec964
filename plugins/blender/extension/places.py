"""Markers on the face as empties: where each marker of the take sits on the character."""

import json
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.kdtree import KDTree

from .character import character_of, face_meshes
from .face_mesh import face_of
from .messages import FaceError, reported

MARKER = "usdface_marker"  # custom property of an empty: the marker's name, if not the object's
_CONFIDENCE = "usdface_confidence"
_COLLECTION = "Face markers"
_SIZE = 0.012  # of an empty, by the size of the face
_FAR = 0.15  # by the size of the face: a marker so far off is on no face
_PARTNERS = (
    ("left", "right"),
    ("Left", "Right"),
    ("LEFT", "RIGHT"),
    ("_l", "_r"),
    ("_L", "_R"),
    (".l", ".r"),
    (".L", ".R"),
    ("L", "R"),
    ("l", "r"),
)


def marker_name(empty: bpy.types.Object) -> str:
    """Return the name of the marker that an empty stands for."""
    return str(empty.get(MARKER, empty.name))


def bound_mesh(scene: bpy.types.Scene) -> bpy.types.Object:
    """Return the mesh that markers sit on: the head, of meshes with the same shape keys."""
    return face_of(face_meshes(character_of(scene)))


def rest_points(mesh: bpy.types.Object) -> np.ndarray:
    """Return the basis of a mesh: (V, 3), in its own space."""
    points = np.empty(3 * len(mesh.data.vertices), np.float32)
    mesh.data.shape_keys.reference_key.data.foreach_get("co", points)
    return points.reshape(-1, 3)


class Surface:
    """The face at rest, to find vertices on."""

    def __init__(self, mesh: bpy.types.Object) -> None:
        self.mesh, self.points = mesh, rest_points(mesh)
        self.size = float(np.ptp(self.points, axis=0).max())
        self._tree = KDTree(len(self.points))
        for i, point in enumerate(self.points):
            self._tree.insert(point, i)
        self._tree.balance()

    def nearest(self, world: Vector) -> tuple[int, float]:
        """Return the vertex nearest to a place of the scene; how far off, by the face's size."""
        _, vertex, distance = self._tree.find(self.mesh.matrix_world.inverted() @ world)
        return vertex, distance / self.size

    def mirrored(self, vertex: int) -> int:
        """Return the vertex nearest to the mirror image of one, left and right exchanged."""
        x, y, z = self.points[vertex]
        return self._tree.find((-x, y, z))[1]


def empties_of(collection: bpy.types.Collection | None) -> list[bpy.types.Object]:
    """Return the empties of a collection."""
    return [o for o in collection.all_objects if o.type == "EMPTY"] if collection else []


def places_of(scene: bpy.types.Scene) -> dict[str, int]:
    """Return the vertex of each marker that has an empty on the face.

    Raises
    ------
    FaceError
        If two empties are one marker, or one is away from the face.
    """
    surface, found = Surface(bound_mesh(scene)), {}
    for empty in empties_of(scene.usdface.places):
        name = marker_name(empty)
        vertex, distance = surface.nearest(empty.matrix_world.translation)
        if name in found:
            raise FaceError(f"two empties are the marker {name}; delete or rename one")
        if distance > _FAR:
            raise FaceError(f"{empty.name} is away from the face; drag it there, or delete it")
        found[name] = vertex
    return found


def bind_of(scene: bpy.types.Scene, mesh_path: str) -> dict:
    """Return the binding of the panel as `usdface shot --bind` reads it."""
    settings = scene.usdface
    places = places_of(scene)
    binding: dict = {"markers": {name: {"point": vertex} for name, vertex in places.items()}}
    if mesh_path:
        binding["mesh"] = mesh_path
    if settings.nose_tip:
        binding["nose_tip"] = settings.nose_tip
    if settings.neutral_start >= 0:
        last = max(settings.neutral_start, settings.neutral_end)
        binding["neutral"] = {"start": settings.neutral_start, "end": last}
    return binding


def write_bind(scene: bpy.types.Scene, mesh_path: str, path: Path) -> bool:
    """Write the binding of the panel; False where it has no marker."""
    binding = bind_of(scene, mesh_path)
    path.write_text(json.dumps(binding, indent=1), encoding="utf-8")
    return bool(binding["markers"])


def show_places(scene: bpy.types.Scene, binding: dict) -> int:
    """Make an empty for each marker of a binding file; return how many.

    Unsure ones are cubes, others spheres. Empties that are there are moved.
    """
    settings = scene.usdface
    surface = Surface(bound_mesh(scene))
    if settings.places is None:
        settings.places = bpy.data.collections.new(_COLLECTION)
        scene.collection.children.link(settings.places)
    there = {marker_name(o): o for o in empties_of(settings.places)}
    placed = {**binding.get("unsure", {}), **binding.get("markers", {})}
    for name, place in placed.items():
        empty = there.get(name) or bpy.data.objects.new(f"marker {name}", None)
        if name not in there:
            settings.places.objects.link(empty)
            empty[MARKER] = name
        empty.empty_display_type = "CUBE" if name in binding.get("unsure", {}) else "SPHERE"
        empty.empty_display_size = _SIZE * surface.size
        empty.show_in_front = True
        empty[_CONFIDENCE] = float(place.get("confidence", 1.0))
        _put(empty, surface, place["point"])
    settings.nose_tip = binding.get("nose_tip", settings.nose_tip)
    neutral = binding.get("neutral")
    if isinstance(neutral, dict):
        settings.neutral_start, settings.neutral_end = neutral["start"], neutral["end"]
    return len(placed)


def _put(empty: bpy.types.Object, surface: Surface, vertex: int) -> None:
    """Put an empty on a vertex, and let it go with the mesh."""
    empty.parent, empty.matrix_parent_inverse = surface.mesh, Matrix.Identity(4)
    empty.location = surface.points[vertex]


def partner_name(name: str, names: set[str]) -> str | None:
    """Return the name of the marker on the other side: one that differs in left and right."""
    for one, other in (*_PARTNERS, *((b, a) for a, b in _PARTNERS)):
        parts = name.split(one)
        for i in range(1, len(parts)):
            candidate = one.join(parts[:i]) + other + one.join(parts[i:])
            if candidate in names:
                return candidate
    return None


class USDFACE_OT_snap_markers(bpy.types.Operator):
    """Put every marker onto the vertex of the face next to it."""

    bl_idname = "usdface.snap_markers"
    bl_label = "Snap to the face"
    bl_options = {"REGISTER", "UNDO"}

    @reported
    def execute(self, context: bpy.types.Context) -> set[str]:
        """Snap the empties of the panel's collection."""
        context.view_layer.update()
        surface = Surface(bound_mesh(context.scene))
        for empty in empties_of(context.scene.usdface.places):
            _put(empty, surface, surface.nearest(empty.matrix_world.translation)[0])
        return {"FINISHED"}


class USDFACE_OT_drag_marker(bpy.types.Operator):
    """Move the selected markers over the face, snapping to its surface."""

    bl_idname = "usdface.drag_marker"
    bl_label = "Drag on the face"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether an empty is active."""
        return context.active_object is not None and context.active_object.type == "EMPTY"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Switch snapping to faces on, for this and later moves."""
        tools = context.scene.tool_settings
        tools.use_snap, tools.snap_elements_base = True, {"FACE"}
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, _: bpy.types.Event) -> set[str]:
        """Begin to move."""
        self.execute(context)
        bpy.ops.transform.translate("INVOKE_DEFAULT")
        return {"FINISHED"}


class USDFACE_OT_mirror_markers(bpy.types.Operator):
    """Put the partners of the selected markers onto the mirror image of their places."""

    bl_idname = "usdface.mirror_markers"
    bl_label = "Mirror"
    bl_options = {"REGISTER", "UNDO"}

    @reported
    def execute(self, context: bpy.types.Context) -> set[str]:
        """Mirror in the plane x = 0 of the mesh."""
        context.view_layer.update()
        surface = Surface(bound_mesh(context.scene))
        empties = {marker_name(o): o for o in empties_of(context.scene.usdface.places)}
        pairs = [
            (empty, empties[partner])
            for name, empty in empties.items()
            if empty.select_get() and (partner := partner_name(name, set(empties)))
        ]
        if not pairs:
            self.report({"WARNING"}, "select markers whose names have a left or right partner")
            return {"CANCELLED"}
        for empty, partner in pairs:
            vertex = surface.nearest(empty.matrix_world.translation)[0]
            _put(partner, surface, surface.mirrored(vertex))
        self.report({"INFO"}, f"{len(pairs)} markers mirrored")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (USDFACE_OT_snap_markers, USDFACE_OT_drag_marker, USDFACE_OT_mirror_markers)
)
