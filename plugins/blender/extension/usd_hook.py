"""The USD hook: a setup for what Blender exports, and a memory for what it imports."""

import contextlib
import json
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import bpy

from .character import INTERNAL, NOT_EXPORTED, character_of, export_character, face_meshes, usd_name
from .face_mesh import face_of
from .messages import FaceError, pop_up, say
from .places import bind_of
from .process import process_command
from .settings import gains_of
from .worker import Worker

_SCOPE = "UsdFace"


class USDFACE_UH_shot(bpy.types.USDHook):
    """Authors the setup of a shot on export; keeps that of an imported one."""

    bl_idname = "USDFACE_UH_shot"
    bl_label = "usdface"

    @staticmethod
    def on_export(context) -> bool:
        """Author the setup and, if that is switched on, process the file; never lose an export."""
        scene = context.get_depsgraph().scene.original
        if INTERNAL["exporting"] or not (scene.usdface.export_setup and is_set_up(scene)):
            return True
        stage = context.get_stage()
        subject = "the export has no setup for usdface"
        try:
            with _all_or_nothing(stage):
                author(scene, stage)
            if scene.usdface.export_process:
                subject = "the exported shot has its setup, but was not processed"
                _process(scene, stage)
        except Exception as error:  # whatever it is, the export goes on
            _fail(scene, subject, error)
        return True

    @staticmethod
    def on_import(context) -> bool:
        """Keep the setup of a shot, put the clock right, and play its result."""
        try:
            _import(bpy.context.scene, context)
        except Exception as error:  # whatever it is, the import goes on
            _fail(bpy.context.scene, "the setup of the imported shot is not kept", error)
        return True


def is_set_up(scene: bpy.types.Scene) -> bool:
    """Whether the panel, or an import, has a setup to export."""
    settings = scene.usdface
    chosen = settings.take_file if settings.take_kind == "FILE" else settings.take_markers
    return bool(settings.kept_setup or chosen)


def author(scene: bpy.types.Scene, stage) -> None:
    """Author the setup of a scene on the stage that it was exported to.

    Raises
    ------
    FaceError, usdface.UsdFaceError
        If the export has no such character, or take and binding do not fit.
    """
    from .key_offsets import show_keys_as_blender
    from .shared_names import share_names
    from .usd_setup import author_gains, mesh_prim, restore, skel_root

    mesh = _bound(scene)
    prim = mesh_prim(stage, mesh.name, usd_name(mesh.name))
    if prim is None:
        raise FaceError(NOT_EXPORTED.format(mesh.name))
    share_names(stage)
    show_keys_as_blender(stage, [o for o in scene.objects if o.type == "MESH"])
    root = stage.GetDefaultPrim() or stage.GetPseudoRoot()
    scope = root.GetPath().AppendChild(_SCOPE)
    if not skel_root(prim):
        raise FaceError(f"{mesh.name} is below no SkelRoot in the export")
    if scene.usdface.kept_setup is not None:
        restore(stage, scene.usdface.kept_setup.as_string(), prim, scope)
    else:
        _author_new(scene, stage, prim, str(scope))
    rate = stage.GetTimeCodesPerSecond()
    stage.SetFramesPerSecond(rate)  # Blender leaves it at USD's 24
    author_gains(stage, gains_of(scene.usdface))


def _bound(scene: bpy.types.Scene) -> bpy.types.Object:
    settings = scene.usdface
    if settings.kept_setup is not None and settings.kept_mesh is not None:
        return settings.kept_mesh
    return face_of(face_meshes(character_of(scene)))


def _author_new(scene: bpy.types.Scene, stage, prim, scope: str) -> None:
    import usdface

    from .usd_setup import skel_root

    settings = scene.usdface
    take, start = _take(scene, stage)
    binding = bind_of(scene, str(prim.GetPath()))
    with tempfile.TemporaryDirectory() as folder:
        bind = Path(folder, "bind.json")
        bind.write_text(json.dumps(binding), encoding="utf-8")
        auto = bool(binding["markers"]) and settings.neutral_start < 0
        usdface.set_up(
            stage,
            take=take,
            rig=skel_root(prim),
            bind=bind if binding["markers"] else None,
            binding=usdface.BindOptions(neutral="auto" if auto else None),
            scope=scope,
            start_code=start,
        )


def _take(scene: bpy.types.Scene, stage) -> tuple:
    """Return the take of the panel and the time code of its first frame."""
    import usdface

    settings = scene.usdface
    if settings.take_kind == "FILE":
        take, _ = usdface.read_take(bpy.path.abspath(settings.take_file))
        return take, float(settings.first_frame)
    from .takes import StageTake, performer_empties

    found = StageTake(stage, performer_empties(scene))
    take = usdface.MarkerTake(
        tuple(found.names), found.times, found.positions, rate=found.rate, source="Blender"
    )
    return take, float(found.codes[0])


@contextlib.contextmanager
def _all_or_nothing(stage):
    """Give the stage back as it was, if the setup fails."""
    from pxr import Sdf

    layer = stage.GetRootLayer()
    before = Sdf.Layer.CreateAnonymous()
    before.TransferContent(layer)
    try:
        yield
    except BaseException:
        layer.TransferContent(before)
        raise


def _process(scene: bpy.types.Scene, stage) -> None:
    """Process the exported file; its layers go beside it."""
    layer = stage.GetRootLayer()
    path = Path(layer.realPath or layer.identifier)
    if bpy.app.tempdir and path.is_relative_to(Path(bpy.app.tempdir)):
        raise FaceError("a .usdz is one file and takes no layers; export .usd, .usda or .usdc")
    layer.Save()
    worker = Worker([process_command(path)])
    worker.wait(time.sleep)
    if worker.error:
        raise FaceError(worker.error)
    written = worker.answers[-1]["written"][0]
    _later(lambda: say(scene, "info", f"processed: open {written}"))


def export_kept_shot(scene: bpy.types.Scene, folder: Path) -> Path:
    """Export the character with the setup that an import kept; return the shot."""
    from pxr import Usd

    shot = folder / "shot.usdc"
    export_character(character_of(scene), shot)
    stage = Usd.Stage.Open(str(shot))
    stage.SetTimeCodesPerSecond(scene.render.fps / scene.render.fps_base)
    author(scene, stage)
    stage.GetRootLayer().Save()
    return shot


def _import(scene: bpy.types.Scene, context) -> None:
    from .usd_setup import bound_mesh_path, is_processed, own_prims, setup_text, setups_of

    stage = context.get_stage()
    setups = setups_of(stage)
    if not setups or INTERNAL["exporting"]:
        return
    path = Path(stage.GetRootLayer().realPath)
    settings = scene.usdface
    text = bpy.data.texts.new(f"{path.name} setup")
    text.write(setup_text(path))
    objects = _objects(context.get_prim_map())
    mesh = _object_of(objects, bound_mesh_path(setups[0]))
    settings.kept_setup, settings.kept_mesh = text, mesh
    if mesh is not None:
        settings.character = mesh.parent or mesh
    rate = stage.GetTimeCodesPerSecond()
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    settings.first_frame = round(stage.GetStartTimeCode())
    _remove(objects, {str(path) for path in own_prims(stage)})
    if len(setups) > 1:
        say(scene, "warning", f"the shot has {len(setups)} setups; {setups[0].GetPath()} is kept")
    if is_processed(setups[0]) and mesh is not None:
        from .playback import play_imported

        play_imported(scene, path)


def _remove(objects: dict[str, bpy.types.Object], own: set[str]) -> None:
    """Remove the objects of our prims: empties of settings, and the take's point cloud.

    Blender makes one object of a transform and the only prim below it.
    """
    for name, item in sorted(objects.items(), key=lambda pair: -len(pair[0])):
        ours = any(name == o or name.startswith(f"{o}/") for o in own)
        holds = [o for o in own if o.startswith(f"{name}/")]
        merged = item.type == "POINTCLOUD" and len(holds) == 1
        emptied = item.type == "EMPTY" and holds and not item.children
        if ours or merged or emptied:
            bpy.data.objects.remove(item)


def _objects(prim_map: dict) -> dict[str, bpy.types.Object]:
    """Return the object that Blender made of each prim."""
    return {
        str(path): item
        for path, made in prim_map.items()
        for item in made
        if isinstance(item, bpy.types.Object)
    }


def _object_of(objects: dict[str, bpy.types.Object], path) -> bpy.types.Object | None:
    """Return the object of a mesh, which Blender may have made of the transform above it alone."""
    places = (path, path.GetParentPath()) if path else ()
    found = [objects[str(place)] for place in places if str(place) in objects]
    return next((item for item in found if item.type == "MESH"), None)


def _fail(scene: bpy.types.Scene, subject: str, error: Exception) -> None:
    """Tell the user; a mistake of ours also with its traceback on the console."""
    text = f"{subject}: {error or type(error).__name__}"
    if not isinstance(error, FaceError) and type(error).__module__.split(".")[0] != "usdface":
        traceback.print_exception(error)
    _later(lambda: say(scene, "error", text))
    pop_up(text)


def _later(call: Callable[[], None]) -> None:
    """Change the scene where that is allowed: an export may run beside the main thread."""
    if bpy.app.background:
        call()
    else:
        bpy.app.timers.register(call, first_interval=0.05)


def register() -> None:
    """Add the hook."""
    bpy.utils.register_class(USDFACE_UH_shot)


def unregister() -> None:
    """Remove it, unless it was removed at Blender's end."""
    if getattr(USDFACE_UH_shot, "is_registered", False):
        bpy.utils.unregister_class(USDFACE_UH_shot)
