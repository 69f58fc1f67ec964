"""What the panel holds, saved with the scene."""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

EMOTIONS = ("joy", "sadness", "anger", "fear", "disgust", "surprise")


def _is_character(_: bpy.types.PropertyGroup, candidate: bpy.types.Object) -> bool:
    return candidate.type in ("MESH", "ARMATURE", "EMPTY")


def _set_influence(settings: "FaceSettings", context: bpy.types.Context) -> None:
    from .playback import set_influence

    set_influence(settings.id_data, settings.influence)


class FaceGain(bpy.types.PropertyGroup):
    """How much of an emotion is shown."""

    # `name` is Blender's own property
    value: FloatProperty(name="Gain", default=1.0, min=0.0, max=4.0, soft_max=2.0)


class FaceMessage(bpy.types.PropertyGroup):
    """A finding of a run, with the action that settles it."""

    severity: StringProperty()
    text: StringProperty()
    remedy: StringProperty()
    marker: StringProperty()
    frame: IntProperty(default=-1)  # of the take


class FaceFrame(bpy.types.PropertyGroup):
    """A frame worth a look."""

    frame: IntProperty()  # of the scene
    residual: FloatProperty()  # mm


class FaceSettings(bpy.types.PropertyGroup):
    """The setup of a face in a scene, and its last result."""

    character: PointerProperty(
        type=bpy.types.Object,
        poll=_is_character,
        name="Character",
        description="A mesh with shape keys, or the armature or empty that such meshes belong to",
    )
    take_kind: EnumProperty(
        name="Take",
        items=(
            ("FILE", "File", "C3D, TRC, CSV, BVH, Live Link Face or USD"),
            ("EMPTIES", "Empties", "Animated empties of a collection, one for each marker"),
        ),
    )
    take_file: StringProperty(name="File", subtype="FILE_PATH")
    take_markers: PointerProperty(
        type=bpy.types.Collection,
        name="Empties",
        description="Collection of the performer's markers, as animated empties",
    )
    places: PointerProperty(
        type=bpy.types.Collection,
        name="Markers on the face",
        description="Collection of the empties that say where each marker sits on the character",
    )
    nose_tip: StringProperty(name="Nose tip", description="Marker on the tip of the nose")
    neutral_start: IntProperty(
        name="Neutral from", default=-1, min=-1, description="Frame of the take; -1 = find it"
    )
    neutral_end: IntProperty(name="to", default=-1, min=-1)
    first_frame: IntProperty(
        name="Begins at", default=1, description="Scene frame of the first frame of the take"
    )
    folder: StringProperty(
        name="Folder",
        subtype="DIR_PATH",
        description="Where results go; empty: beside the .blend file, or a temporary folder",
    )
    gains: CollectionProperty(type=FaceGain)
    influence: FloatProperty(
        name="Raw to expressive",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_set_influence,
        options=set(),
        description="0: the take as solved; 1: with corrected expressions",
    )
    export_setup: BoolProperty(
        name="Setup into USD exports",
        default=True,
        description="An exported character comes with take and setup, for `usdface process`",
    )
    export_process: BoolProperty(
        name="Process on export",
        default=False,
        description="The exported shot comes with its layers: NAME.usdface.usda beside it",
    )
    kept_setup: PointerProperty(
        type=bpy.types.Text,
        name="Setup of the imported shot",
        description="Prims that a USD import brought and the next export authors again",
    )
    kept_mesh: PointerProperty(type=bpy.types.Object, name="Its mesh")
    shot: StringProperty(name="Shot", subtype="FILE_PATH")
    result: StringProperty(name="Result", subtype="FILE_PATH")
    verdict: StringProperty()
    messages: CollectionProperty(type=FaceMessage)
    worst: CollectionProperty(type=FaceFrame)


_add_classes, _remove_classes = bpy.utils.register_classes_factory(
    (FaceGain, FaceMessage, FaceFrame, FaceSettings)
)


def begin_of_take(scene: bpy.types.Scene) -> int:
    """Return the scene frame of the first frame of the take; one of empties is the scene's."""
    settings = scene.usdface
    empties = settings.kept_setup is None and settings.take_kind == "EMPTIES"
    return scene.frame_start if empties else settings.first_frame


def gains_of(settings: FaceSettings) -> dict[str, float]:
    """Return the gain of each emotion; without those at 1."""
    return {gain.name: gain.value for gain in settings.gains if gain.value != 1.0}


def list_gains(settings: FaceSettings, emotions: tuple[str, ...] = EMOTIONS) -> None:
    """List a gain for each emotion, in their order; values that are there are kept."""
    there = {gain.name: gain.value for gain in settings.gains}
    settings.gains.clear()
    for emotion in emotions:
        gain = settings.gains.add()
        gain.name, gain.value = emotion, there.get(emotion, 1.0)


def register() -> None:
    """Add the settings to scenes."""
    _add_classes()
    bpy.types.Scene.usdface = PointerProperty(type=FaceSettings)


def unregister() -> None:
    """Remove them."""
    del bpy.types.Scene.usdface
    _remove_classes()
