"""The sidebar: usdface in the 3D view."""

import bpy

from . import last_result
from .process import RUNNING

_LINE = 46  # characters of a line of text


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "usdface"


class USDFACE_PT_shot(_Sidebar, bpy.types.Panel):
    """Character, take, and the button."""

    bl_idname = "USDFACE_PT_shot"
    bl_label = "Face"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choices and Process."""
        layout, settings = self.layout, context.scene.usdface
        row = layout.row(align=True)
        row.prop(settings, "character")
        row.operator("usdface.choose_character", text="", icon="EYEDROPPER")
        if settings.kept_setup is not None:
            layout.prop(settings, "kept_setup", text="Imported shot")
        else:
            layout.row().prop(settings, "take_kind", expand=True)
            kind = "take_file" if settings.take_kind == "FILE" else "take_markers"
            layout.prop(settings, kind, text="")
        layout.prop(settings, "first_frame")
        layout.prop(settings, "folder")
        worker = RUNNING.get("worker")
        if worker is None:
            layout.operator("usdface.process", icon="PLAY")
            return
        row = layout.row(align=True)
        row.progress(factor=worker.progress, text=worker.step)
        row.operator("usdface.cancel", text="", icon="X")


class USDFACE_PT_markers(_Sidebar, bpy.types.Panel):
    """Markers on the face."""

    bl_idname = "USDFACE_PT_markers"
    bl_label = "Markers on the face"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the tools."""
        layout, settings = self.layout, context.scene.usdface
        layout.prop(settings, "places", text="")
        column = layout.column(align=True)
        column.operator("usdface.propose", icon="VIEWZOOM")
        row = column.row(align=True)
        row.operator("usdface.drag_marker", icon="SNAP_FACE")
        row.operator("usdface.mirror_markers", icon="MOD_MIRROR")
        column.operator("usdface.snap_markers", icon="SNAP_ON")
        row = layout.row(align=True)
        row.prop(settings, "nose_tip")
        row.operator("usdface.choose_nose_tip", text="", icon="EYEDROPPER")
        row = layout.row(align=True)
        row.prop(settings, "neutral_start")
        row.prop(settings, "neutral_end")
        row = layout.row(align=True)
        row.operator("usdface.neutral_here")
        row.operator("usdface.neutral_here", text="", icon="ARROW_LEFTRIGHT").extend = True


class USDFACE_PT_result(_Sidebar, bpy.types.Panel):
    """The result: how much is shown, why, and where to look."""

    bl_idname = "USDFACE_PT_result"
    bl_label = "Result"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is something to show."""
        settings = context.scene.usdface
        return bool(settings.result or settings.messages)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw sliders, rules, frames and messages."""
        layout, scene = self.layout, context.scene
        settings = scene.usdface
        if settings.result:
            layout.prop(settings, "influence", slider=True)
            self._gains(layout, settings)
            self._rules(layout, scene)
            self._frames(layout, settings)
            layout.operator("usdface.choose_gltf", icon="EXPORT")
        self._messages(layout, settings)

    def _gains(self, layout, settings) -> None:
        column = layout.column(align=True)
        column.label(text="Gains (then Process)")
        for gain in settings.gains:
            column.prop(gain, "value", text=gain.name, slider=True)

    def _rules(self, layout, scene) -> None:
        if not last_result.is_kept(scene):
            layout.operator("usdface.load_result", icon="FILE_REFRESH")
            return
        frame = scene.frame_current_final
        column = layout.column(align=True)
        shown = [
            f"{n} {v:.2f}" for n, v in last_result.emotions_at(scene, frame).items() if v > 0.02
        ]
        column.label(text=", ".join(shown) or "no emotion at this frame")
        for strength, text in last_result.rules_at(scene, frame):
            _text(column, f"{strength:.2f}  {text}")

    def _frames(self, layout, settings) -> None:
        if not settings.worst:
            return
        column = layout.column(align=True)
        column.operator("usdface.worst_frame", icon="TRACKING_REFINE_FORWARDS")
        for worst in settings.worst:
            text = f"{worst.frame}: {worst.residual:.2f} mm"
            column.operator("usdface.go_to_frame", text=text).frame = worst.frame

    def _messages(self, layout, settings) -> None:
        if settings.verdict:
            layout.label(text=f"Verdict: {settings.verdict}")
        for message in settings.messages:
            box = layout.box().column(align=True)
            icon = "INFO" if message.severity == "info" else "ERROR"
            _text(box, message.text, icon)
            if message.remedy:
                _text(box, message.remedy, "FORWARD")
            if message.frame >= 0:
                go = box.operator("usdface.go_to_frame", text=f"Frame {message.frame}")
                go.frame = settings.first_frame + message.frame
            if message.marker:
                text = f"Select {message.marker}"
                box.operator("usdface.select_marker", text=text).name = message.marker
        if settings.messages:
            layout.operator("usdface.clear_messages", icon="TRASH")


class USDFACE_PT_export(_Sidebar, bpy.types.Panel):
    """The hook of USD exports."""

    bl_idname = "USDFACE_PT_export"
    bl_label = "USD export"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw its switches."""
        settings = context.scene.usdface
        self.layout.prop(settings, "export_setup")
        row = self.layout.row()
        row.active = settings.export_setup
        row.prop(settings, "export_process")


def _text(layout, text: str, icon: str = "NONE") -> None:
    """Draw text in lines that fit the sidebar."""
    line = ""
    for word in text.split():
        if line and len(line) + len(word) >= _LINE:
            layout.label(text=line, icon=icon)
            line, icon = "", "BLANK1" if icon != "NONE" else "NONE"
        line = f"{line} {word}".strip()
    layout.label(text=line, icon=icon)


PANELS = (USDFACE_PT_shot, USDFACE_PT_markers, USDFACE_PT_result, USDFACE_PT_export)

register, unregister = bpy.utils.register_classes_factory(PANELS)
