"""Findings and errors, told in Blender's own way."""

from collections.abc import Callable
from functools import wraps

import bpy
from bpy.types import Context, Operator

# Actions in Blender for the codes of verdicts and findings; others have the remedy of the report.
REMEDIES = {
    "BINDING_UNSURE": "drag these markers to their places on the face",
    "PLACES_MISFIT": "look at the markers on the face and drag those that are off",
    "PLACE_WRONG": "drag this marker to its place on the face, or correct its name",
    "PLACES_BESIDE": "drag the markers to where they sit on the performer",
    "MOTION_UNEXPLAINED": "check the places of these markers; the character may lack shape keys",
    "MOTION_BEYOND_SHAPES": "add or enlarge shape keys there; the rest of the face follows",
    "SIDES_MIRRORED": "exchange left and right in the names of the markers",
    "NEUTRAL_EXPRESSIVE": "go to a frame where the face rests, then Neutral from this frame",
    "NEUTRAL_ASSUMED": "go to a frame where the face rests, then Neutral from this frame",
    "MARKER_ASTRAY": "look at its track, move it on the face, or delete its empty",
    "MARKER_UNKNOWN": "rename its empty as the take does, or delete it",
    "MARKER_UNBOUND": "Propose places, or add an empty with its name",
    "MARKERS_OCCLUDED": "delete the empties of markers that are hardly seen",
    "SHAPE_RESTS_OPEN": "check the neutral frames",
    "TAKE_SIZE": "check the unit of the take",
    "RIG_SIZE": "if it is meant to be human, scale the character",
}


class FaceError(Exception):
    """A reason not to go on, in a line for the user."""


def reported(execute: Callable[[Operator, Context], set[str]]) -> Callable[..., set[str]]:
    """Let an operator end with the line of a FaceError, in place of a traceback."""

    @wraps(execute)
    def told(self: Operator, context: Context) -> set[str]:
        try:
            return execute(self, context)
        except FaceError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return told


def say(scene: bpy.types.Scene, severity: str, text: str, remedy: str = "") -> None:
    """Add a message to the panel, and print it."""
    message = scene.usdface.messages.add()
    message.severity, message.text, message.remedy = severity, text, remedy
    print(f"usdface: {severity}: {text}" + (f" ({remedy})" if remedy else ""))


def pop_up(text: str) -> None:
    """Show a message over the windows, if there are any; for code that no operator runs."""
    if bpy.app.background:
        return

    def show() -> None:
        def draw(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
            menu.layout.label(text=text)

        bpy.context.window_manager.popup_menu(draw, title="usdface", icon="ERROR")

    # An export may run beside the main thread, where no menu may open
    bpy.app.timers.register(show, first_interval=0.1)


def list_verdict(settings, verdict) -> None:
    """List the reasons of a verdict of usdface, each with the action that settles it."""
    settings.verdict = verdict.level.replace("_", " ") if verdict else ""
    for reason in verdict.reasons if verdict else ():
        code, measured = reason.criterion.code, reason.measured
        message = _listed(settings, reason.level.replace("_", " "), code, reason.message)
        message.remedy = REMEDIES.get(code, reason.criterion.remedy)
        message.marker = next(iter(measured.where), "") if measured.kind == "markers" else ""
        message.frame = measured.frames[0] if measured.frames else -1


def list_findings(settings, findings: list[dict]) -> None:
    """List the warnings of a report, each once."""
    seen = set()
    for found in findings:
        text = _words(found)
        if found["severity"] != "info" and (found["code"], text) not in seen:
            seen.add((found["code"], text))
            message = _listed(settings, found["severity"], found["code"], text)
            action = found["action"].replace("_", " ")
            message.remedy = REMEDIES.get(found["code"], "" if action == "nothing" else action)


def _words(found: dict) -> str:
    """Say a finding of a report, which has values and no prose, in the words of its code."""
    import usdface

    said = usdface.finding(found["code"], found["where"]).message
    values = (f"{key.replace('_', ' ')} {value}" for key, value in found["values"].items())
    return f"{said} ({'; '.join(filter(None, [found['where'], *values]))})"


def _listed(settings, severity: str, code: str, text: str):
    message = settings.messages.add()
    message.name, message.severity, message.text = code, severity, text
    return message


class USDFACE_OT_clear_messages(bpy.types.Operator):
    """Clear the list of messages."""

    bl_idname = "usdface.clear_messages"
    bl_label = "Clear messages"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Clear them."""
        context.scene.usdface.messages.clear()
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((USDFACE_OT_clear_messages,))
