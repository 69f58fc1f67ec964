"""Choices from the state of the scene: character, nose tip, neutral frames."""

import bpy

from .character import face_meshes
from .places import empties_of, marker_name
from .settings import begin_of_take


class USDFACE_OT_choose_character(bpy.types.Operator):
    """Take the active object as the character."""

    bl_idname = "usdface.choose_character"
    bl_label = "Character from selection"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Take it, if it has shape keys."""
        active = context.active_object
        if active is None:
            self.report({"ERROR"}, "select a mesh with shape keys, or its armature")
            return {"CANCELLED"}
        if not face_meshes(active):
            self.report({"ERROR"}, f"{active.name} has no shape keys, nor has any mesh below it")
            return {"CANCELLED"}
        context.scene.usdface.character = active
        return {"FINISHED"}


class USDFACE_OT_choose_nose_tip(bpy.types.Operator):
    """Take the active marker as the tip of the nose."""

    bl_idname = "usdface.choose_nose_tip"
    bl_label = "Nose tip from selection"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Take it, if it is a marker on the face."""
        active = context.active_object
        if active is None or active not in empties_of(context.scene.usdface.places):
            self.report({"ERROR"}, "select one of the markers on the face")
            return {"CANCELLED"}
        context.scene.usdface.nose_tip = marker_name(active)
        return {"FINISHED"}


class USDFACE_OT_neutral_here(bpy.types.Operator):
    """Take the current frame as neutral; with Extend, up to it or from it on."""

    bl_idname = "usdface.neutral_here"
    bl_label = "Neutral from this frame"
    bl_options = {"REGISTER", "UNDO"}

    extend: bpy.props.BoolProperty(name="Extend", default=False)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the neutral frames."""
        settings = context.scene.usdface
        begin = begin_of_take(context.scene)
        frame = context.scene.frame_current - begin
        if frame < 0:
            self.report({"ERROR"}, f"the take begins at frame {begin}")
            return {"CANCELLED"}
        first, last = (
            (settings.neutral_start, settings.neutral_end) if self.extend else (frame,) * 2
        )
        settings.neutral_start = min(frame, first) if first >= 0 else frame
        settings.neutral_end = max(frame, last)
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (USDFACE_OT_choose_character, USDFACE_OT_choose_nose_tip, USDFACE_OT_neutral_here)
)
