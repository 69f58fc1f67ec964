"""Going to the frames and markers that the result is about."""

import bpy

from .places import empties_of, marker_name


class USDFACE_OT_go_to_frame(bpy.types.Operator):
    """Go to this frame."""

    bl_idname = "usdface.go_to_frame"
    bl_label = "Go to frame"
    bl_options = {"REGISTER", "UNDO"}

    frame: bpy.props.IntProperty()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the current frame."""
        context.scene.frame_set(self.frame)
        return {"FINISHED"}


class USDFACE_OT_worst_frame(bpy.types.Operator):
    """Go to the next of the worst frames."""

    bl_idname = "usdface.worst_frame"
    bl_label = "Next worst frame"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Go from the worst to the better ones, and begin again."""
        frames = [worst.frame for worst in context.scene.usdface.worst]
        if not frames:
            self.report({"WARNING"}, "there is no result yet; Process first")
            return {"CANCELLED"}
        now = context.scene.frame_current
        following = frames.index(now) + 1 if now in frames else 0
        context.scene.frame_set(frames[following % len(frames)])
        return {"FINISHED"}


class USDFACE_OT_select_marker(bpy.types.Operator):
    """Select the empty of this marker."""

    bl_idname = "usdface.select_marker"
    bl_label = "Select marker"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select it alone, and make it active."""
        for empty in empties_of(context.scene.usdface.places):
            if marker_name(empty) == self.name:
                for other in context.view_layer.objects:
                    other.select_set(other == empty)
                context.view_layer.objects.active = empty
                return {"FINISHED"}
        self.report({"WARNING"}, f"no marker on the face is named {self.name}")
        return {"CANCELLED"}


register, unregister = bpy.utils.register_classes_factory(
    (USDFACE_OT_go_to_frame, USDFACE_OT_worst_frame, USDFACE_OT_select_marker)
)
