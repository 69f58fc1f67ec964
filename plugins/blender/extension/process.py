"""Process and Propose: the export, the commands, and what they answer, while Blender goes on."""

import tempfile
import time
from pathlib import Path

import bpy

from .character import NOT_SHOWN, character_of, export_character, face_meshes, usd_name
from .face_mesh import face_of
from .messages import FaceError, list_findings, say
from .places import show_places, write_bind
from .settings import gains_of
from .worker import Command, Worker

_SECONDS = 0.1  # between two looks at the worker
RUNNING: dict[str, Worker] = {}  # "worker": the one that runs


def work_folder(scene: bpy.types.Scene) -> Path:
    """Return the folder of results, and make it.

    Raises
    ------
    FaceError
        If nothing can be written there.
    """
    settings = scene.usdface
    if settings.folder:
        folder = Path(bpy.path.abspath(settings.folder))
    elif bpy.data.filepath:
        folder = Path(bpy.data.filepath).with_suffix(".usdface") / bpy.path.clean_name(scene.name)
    else:
        folder = Path(bpy.app.tempdir) / "usdface" / bpy.path.clean_name(scene.name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FaceError(
            f"cannot write into {folder}: {error.strerror}; choose another Folder"
        ) from error
    return folder


def take_command(scene: bpy.types.Scene, folder: Path) -> tuple[Command, Path]:
    """Return the command that makes a USD take of the panel's, and that take."""
    settings, made = scene.usdface, folder / "take.usdc"
    if settings.take_kind == "EMPTIES":
        from .takes import write_take_of_empties

        source, rate = write_take_of_empties(scene, folder)
        more = ("--units", "m", "--up-axis", "Y", "--rate", repr(rate))
    else:
        source, more = Path(bpy.path.abspath(settings.take_file)), ()
        if not settings.take_file or not source.is_file():
            raise FaceError(f"there is no take {settings.take_file or '(no file is chosen)'}")
        if source.suffix.lower() in (".usd", ".usda", ".usdc"):
            made = folder / "take_of_usd.usdc"
    words = ("take", str(source), "-o", str(made), *more, "--format", "json", "--progress", "json")
    return Command("take", words), made


def shot_command(scene: bpy.types.Scene, take: Path, folder: Path, *extra: str) -> Command:
    """Export the character and return the command that makes the shot of it and a take."""
    rig, bind = folder / "character.usdc", folder / "bind.json"
    character = character_of(scene)
    export_character(character, rig)
    placed = write_bind(scene, _prepare_rig(rig, face_meshes(character)), bind)
    words = ["shot", "--rig", str(rig), "--take", str(take), "-o", str(folder / "shot.usda")]
    words += ["--bind", str(bind)]
    words += [] if placed or "--propose" in extra else ["--propose"]
    words += ["--neutral", "auto"] if scene.usdface.neutral_start < 0 else []
    words += ["--overwrite", "--print-bind", "--progress", "json", *extra]
    return Command("shot", tuple(words))


def _prepare_rig(rig: Path, meshes: list[bpy.types.Object]) -> str:
    """Give blend shapes of an exported character their names and offsets; return its face's path.

    Raises
    ------
    FaceError
        If Blender exported no blend shapes.
    """
    from pxr import Usd

    from .key_offsets import show_keys_as_blender
    from .shared_names import share_names
    from .usd_setup import mesh_prim

    stage, mesh = Usd.Stage.Open(str(rig)), face_of(meshes).name
    share_names(stage)
    show_keys_as_blender(stage, meshes)
    prim = mesh_prim(stage, mesh, usd_name(mesh))
    if prim is None:
        raise FaceError(NOT_SHOWN.format(mesh))
    stage.GetRootLayer().Save()
    return str(prim.GetPath())


def process_command(shot: Path, gains: dict[str, float] | None = None) -> Command:
    """Return the command that processes a shot, with gains beside those that it holds."""
    words = ["process", str(shot), "--format", "json", "--progress", "json"]
    if gains:
        words += ["--gains", ",".join(f"{name}={value:g}" for name, value in gains.items())]
    return Command("process", tuple(words))


class _Job:
    """An operator that runs a worker: modal in a window, to its end in a script."""

    bl_options = {"REGISTER", "UNDO"}

    def prepare(self, context: bpy.types.Context) -> list[Command]:
        """Return the commands."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context, worker: Worker) -> None:
        """Take the answers over into the scene."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run to the end: scripts, background mode."""
        if not self._begin(context):
            return {"CANCELLED"}
        self._worker.wait(time.sleep)
        return self._end(context)

    def invoke(self, context: bpy.types.Context, _: bpy.types.Event) -> set[str]:
        """Start, and let Blender go on."""
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look at the worker; all events are Blender's."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        running = self._worker.poll()
        _show(context)
        if running:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._end(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """End the worker, for Blender ends or opens another file."""
        self._worker.cancel()
        RUNNING.clear()

    def _begin(self, context: bpy.types.Context) -> bool:
        if RUNNING:
            self.report({"ERROR"}, "usdface is at work already; wait, or cancel it")
            return False
        context.view_layer.update()  # a script may have moved markers just now
        try:
            commands = self.prepare(context)
        except FaceError as error:
            self.report({"ERROR"}, str(error))
            return False
        self._scene = context.scene.name
        context.scene.usdface.messages.clear()
        self._worker = RUNNING["worker"] = Worker(commands)
        return True

    def _end(self, context: bpy.types.Context) -> set[str]:
        RUNNING.clear()
        scene = bpy.data.scenes.get(self._scene)
        if scene is None:
            self.report({"ERROR"}, f"the scene {self._scene} is gone; its result is left in files")
            return {"CANCELLED"}
        if self._worker.error:
            say(scene, "error", self._worker.error)
            self.report({"ERROR"}, self._worker.error)
        try:
            self.finish(context, self._worker)
        except (FaceError, OSError, RuntimeError) as error:
            say(scene, "error", str(error))
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"CANCELLED"} if self._worker.error else {"FINISHED"}


def _show(context: bpy.types.Context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


class USDFACE_OT_propose(_Job, bpy.types.Operator):
    """Find where each marker of the take sits on the character, as empties to check and drag."""

    bl_idname = "usdface.propose"
    bl_label = "Propose places"

    def prepare(self, context: bpy.types.Context) -> list[Command]:
        """Export the character; markers that have empties stay where they are."""
        folder = work_folder(context.scene)
        take, made = take_command(context.scene, folder)
        return [take, shot_command(context.scene, made, folder, "--propose")]

    def finish(self, context: bpy.types.Context, worker: Worker) -> None:
        """Make the empties, also where some are unsure."""
        bindings = [answer for answer in worker.answers if "markers" in answer]
        if bindings:
            count = show_places(bpy.data.scenes[self._scene], bindings[-1])
            unsure = len(bindings[-1].get("unsure", ()))
            self.report({"INFO"}, f"{count} markers placed, {unsure} of them unsure (cubes)")


class USDFACE_OT_process(_Job, bpy.types.Operator):
    """Retarget the take to the character and correct its expressions."""

    bl_idname = "usdface.process"
    bl_label = "Process"

    def prepare(self, context: bpy.types.Context) -> list[Command]:
        """Export the character, or the shot that an import kept."""
        scene, settings = context.scene, context.scene.usdface
        folder = work_folder(scene)
        if settings.kept_setup is not None:
            from .usd_hook import export_kept_shot

            shot = export_kept_shot(scene, folder)
            commands = []
        else:
            take, made = take_command(scene, folder)
            shot = folder / "shot.usda"
            commands = [take, shot_command(scene, made, folder)]
        settings.shot = str(shot)
        gains = None if settings.kept_setup is not None else gains_of(settings)
        return [*commands, process_command(shot, gains)]

    def finish(self, context: bpy.types.Context, worker: Worker) -> None:
        """Play the result."""
        if worker.error:
            return
        from .playback import play_result

        scene = bpy.data.scenes[self._scene]
        scene.usdface.result = worker.answers[-1]["written"][0]
        text = play_result(scene, Path(scene.usdface.result))
        list_findings(scene.usdface, worker.answers[-1]["findings"])
        self.report({"INFO"}, text)


class USDFACE_OT_cancel(bpy.types.Operator):
    """End the work that runs; the scene stays as it is."""

    bl_idname = "usdface.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether anything runs."""
        return bool(RUNNING)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """End the worker's process."""
        RUNNING["worker"].cancel()
        return {"FINISHED"}


register, _unregister_classes = bpy.utils.register_classes_factory(
    (USDFACE_OT_propose, USDFACE_OT_process, USDFACE_OT_cancel)
)


def unregister() -> None:
    """Remove the operators, and end what runs."""
    if RUNNING:
        RUNNING.pop("worker").cancel()
    _unregister_classes()
