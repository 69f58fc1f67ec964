"""A result as shape-key actions: raw and expressive, on two NLA tracks with one influence."""

from pathlib import Path

import bpy
import numpy as np

from . import last_result
from .character import character_of, face_meshes, key_names, usd_name
from .messages import FaceError, list_verdict, reported, say
from .settings import EMOTIONS, list_gains

RAW, EXPRESSIVE = "usdface raw", "usdface expressive"
_BEFORE = "before usdface"
_LINEAR = 1  # of `Keyframe.interpolation`, as foreach_set takes it


def play_result(scene: bpy.types.Scene, path: Path) -> str:
    """Play the result of `process` on the scene's character; return a line for the user.

    Raises
    ------
    FaceError
        If it cannot be read, or the character has none of its shape keys.
    """
    import usdface

    try:
        played, _ = usdface.read_result(path)
    except usdface.UsdFaceError as error:
        raise FaceError(str(error)) from error
    settings = scene.usdface
    rate = played.shot.take.rate
    frames = settings.first_frame + played.corrected.times * rate
    count = write_actions(scene, frames, played.solved, played.corrected)
    if not count:
        raise FaceError(f"no shape key of the character has a name of the result {path.name}")
    set_clock(scene, frames, rate)
    settings.result = str(path)
    last_result.keep(scene, played)
    list_gains(settings, tuple(played.emotions) or EMOTIONS)
    list_verdict(settings, played.verdict)
    last_result.list_worst(scene)
    _report_linked(scene)
    return f"{count} shape keys, {len(frames)} frames at {rate:g} fps; verdict: {settings.verdict}"


def _report_linked(scene: bpy.types.Scene) -> None:
    """Report shape keys whose animation is lost with this session: Blender saves none on linked."""
    meshes = [mesh for mesh in face_meshes(character_of(scene)) if mesh.data.shape_keys.library]
    if meshes:
        text = f"the shape keys of {', '.join(mesh.name for mesh in meshes)} are linked"
        remedy = "Make Local, Selected Objects and Data, and Process; or Load result on reopening"
        say(scene, "warning", f"{text}: Blender does not save what plays on them", remedy)


def play_imported(scene: bpy.types.Scene, path: Path) -> str:
    """Play a result whose character was imported just now, in place of the imported curves."""
    for mesh in face_meshes(character_of(scene)):
        data = mesh.data.shape_keys.animation_data
        action = data.action if data else None
        if action is not None:
            data.action = None
            if not action.users:
                bpy.data.actions.remove(action)
    return play_result(scene, path)


def set_clock(scene: bpy.types.Scene, frames: np.ndarray, rate: float) -> None:
    """Set rate and range of the scene to those of a take, also 59.94 or 29.97."""
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.frame_start, scene.frame_end = int(frames[0]), int(np.ceil(frames[-1]))


def write_actions(scene: bpy.types.Scene, frames: np.ndarray, solved, corrected) -> int:
    """Write both actions of every mesh of the character; return how many shape keys they move."""
    moved = set()
    for mesh in face_meshes(character_of(scene)):
        columns = {
            name: column
            for name in key_names(mesh)
            if (column := _column(name, solved.names, corrected.names)) is not None
        }
        if not columns:
            continue
        moved |= set(columns)
        keys = mesh.data.shape_keys
        data = keys.animation_data or keys.animation_data_create()
        _clear(data)
        for track_name, weights, influence in (
            (RAW, solved.weights, None),
            (EXPRESSIVE, corrected.weights, scene.usdface.influence),
        ):
            which = track_name == EXPRESSIVE
            curves = {name: weights[:, places[which]] for name, places in columns.items()}
            action = _action(f"{mesh.name} {track_name}", keys, frames, curves)
            _strip(data, track_name, action, frames, influence)
    return len(moved)


def _column(name: str, solved: tuple[str, ...], corrected: tuple[str, ...]) -> tuple | None:
    """Return where a shape key is among the weights; None if it is not."""
    for wanted in (name, usd_name(name)):
        if wanted in solved and wanted in corrected:
            return solved.index(wanted), corrected.index(wanted)
    return None


def _action(name: str, keys: bpy.types.Key, frames: np.ndarray, curves: dict) -> bpy.types.Action:
    """Make an action with one slot, in layers: all Blender has from 5.0 on."""
    action = bpy.data.actions.new(name)
    slot = action.slots.new("KEY", keys.name)
    strip = action.layers.new("weights").strips.new(type="KEYFRAME")
    bag = strip.channelbag(slot, ensure=True)
    for key, values in curves.items():
        curve = bag.fcurves.new(f'key_blocks["{bpy.utils.escape_identifier(key)}"].value')
        points = np.column_stack([frames, values]).astype(np.float32)
        curve.keyframe_points.add(len(points))
        curve.keyframe_points.foreach_set("co", points.ravel())
        curve.keyframe_points.foreach_set("interpolation", [_LINEAR] * len(points))
        curve.update()
    return action


def _strip(data, track_name: str, action, frames: np.ndarray, influence: float | None) -> None:
    track = data.nla_tracks.new()
    track.name = track_name
    strip = track.strips.new(track_name, int(frames[0]), action)
    strip.action_slot = action.slots[0]
    strip.frame_start = float(frames[0])
    strip.extrapolation = "HOLD"
    strip.blend_type = "REPLACE"
    if influence is not None:
        strip.use_animated_influence = True
        _influence(strip, influence)


def _clear(data: bpy.types.AnimData) -> None:
    """Remove our tracks and their actions; an action of the user's goes to a muted track."""
    for track in [t for t in data.nla_tracks if t.name.startswith((RAW, EXPRESSIVE))]:
        actions = [strip.action for strip in track.strips if strip.action]
        data.nla_tracks.remove(track)
        for action in actions:
            if not action.users:
                bpy.data.actions.remove(action)
    if data.action is not None:
        action, slot = data.action, data.action_slot
        track = data.nla_tracks.new()
        track.name, track.mute = _BEFORE, True
        strip = track.strips.new(_BEFORE, int(action.frame_range[0]), action)
        strip.action_slot = slot
        data.action = None


def set_influence(scene: bpy.types.Scene, value: float) -> None:
    """Set the influence of the expressive tracks of a scene's character."""
    try:
        meshes = face_meshes(character_of(scene))
    except FaceError:
        return
    for mesh in meshes:
        data = mesh.data.shape_keys.animation_data
        for track in data.nla_tracks if data else ():
            for strip in track.strips if track.name.startswith(EXPRESSIVE) else ():
                _influence(strip, value)
        mesh.data.shape_keys.update_tag()


def _influence(strip: bpy.types.NlaStrip, value: float) -> None:
    """Set the influence, which Blender takes from a curve of the strip."""
    strip.influence = value
    curve = strip.fcurves.find("influence")
    if curve is not None:
        if not curve.keyframe_points:
            curve.keyframe_points.insert(strip.frame_start, value)
        for point in curve.keyframe_points:
            point.co[1] = value
        curve.update()


class USDFACE_OT_load_result(bpy.types.Operator):
    """Play the last result again: after the .blend file was opened, or layers were edited."""

    bl_idname = "usdface.load_result"
    bl_label = "Load result"
    bl_options = {"REGISTER", "UNDO"}

    @reported
    def execute(self, context: bpy.types.Context) -> set[str]:
        """Read it and write the actions."""
        path = Path(bpy.path.abspath(context.scene.usdface.result))
        context.scene.usdface.messages.clear()
        self.report({"INFO"}, play_result(context.scene, path))
        return {"FINISHED"}


def register() -> None:
    """Add the operator."""
    bpy.utils.register_class(USDFACE_OT_load_result)


def unregister() -> None:
    """Remove it."""
    bpy.utils.unregister_class(USDFACE_OT_load_result)
    last_result.forget()
