"""The result as glTF, written by usdface: `usdface export`."""

from pathlib import Path

import bpy

from .messages import FaceError
from .process import _Job
from .worker import Command, Worker


class USDFACE_OT_export_gltf(_Job, bpy.types.Operator):
    """Write the result as glTF with morph targets and a certificate of the conversion."""

    bl_idname = "usdface.export_gltf"
    bl_label = "Export glTF"

    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})

    def prepare(self, context: bpy.types.Context) -> list[Command]:
        """Check that there is a result."""
        result = Path(bpy.path.abspath(context.scene.usdface.result))
        if not context.scene.usdface.result or not result.is_file():
            raise FaceError("there is no result yet; Process first")
        target = Path(bpy.path.abspath(self.filepath) or result.with_suffix(".glb"))
        words = ["export", str(result), "-o", str(target), "--format", "json", "--progress", "json"]
        words += ["--overwrite"] if self.filepath else []  # who chose the name was asked
        return [Command("export", tuple(words))]

    def finish(self, context: bpy.types.Context, worker: Worker) -> None:
        """Say which file was written."""
        if not worker.error:
            self.report({"INFO"}, f"wrote {worker.answers[-1]['written'][0]}")


class USDFACE_OT_choose_gltf(bpy.types.Operator):
    """Choose a file and write the result as glTF."""

    bl_idname = "usdface.choose_gltf"
    bl_label = "Export glTF ..."

    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    # The file browser marks a name that exists, and asks.
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _: bpy.types.Event) -> set[str]:
        """Open the file browser."""
        self.filepath = self.filepath or "face.glb"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start the export."""
        call = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
        return bpy.ops.usdface.export_gltf(call, filepath=self.filepath)


register, unregister = bpy.utils.register_classes_factory(
    (USDFACE_OT_export_gltf, USDFACE_OT_choose_gltf)
)
