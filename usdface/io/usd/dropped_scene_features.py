"""Features of a USD stage's cameras and lights that glTF lacks."""

from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdLux

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.rendered_meshes import visibility_changes
from usdface.io.usd.world_transforms import moves_in_world

__all__ = ["report_dropped_features"]

_START = Usd.TimeCode.EarliestTime()
# Of a camera, those that change the picture; what is sharp at all depends on fStop.
_OF_CAMERAS = (
    *("horizontalApertureOffset", "verticalApertureOffset", "fStop", "exposure"),
    *("clippingPlanes", "stereoRole"),
)
_OF_LIGHTS = "inputs:"
_READ = {
    *("inputs:angle", "inputs:radius", "inputs:intensity", "inputs:exposure", "inputs:normalize"),
    *("inputs:color", "inputs:colorTemperature", "inputs:enableColorTemperature"),
    *("inputs:shaping:cone:angle", "inputs:shaping:cone:softness"),
}
_OTHERS = ("xformOp", "visibility", "userProperties:", "usdface:")  # reported, or read, elsewhere


def report_dropped_features(prim: Usd.Prim) -> list[Finding]:
    """Return findings on motion of a camera or light, and its features that glTF lacks."""
    found, where = [], str(prim.GetPath())
    if moves_in_world(prim):
        message = "it stands still: its animation is not kept"
        found.append(finding("ANIMATION_DROPPED", where, message))
    changing = [each.GetName() for each in _authored(prim) if changes(each)]
    changing += ["visibility"] if visibility_changes(prim) else []
    if changing:
        message = "they change over time, and stay as at the first: {channels}"
        found.append(finding("ANIMATION_DROPPED", where, message, sorted(changing)))
    if lacking := sorted(_lacking(prim)):
        kind = "light" if prim.HasAPI(UsdLux.LightAPI) else "camera"
        message = "attributes of the {type} that are not kept: {attributes}"
        found.append(finding("FEATURE_DROPPED", where, message, kind, lacking, feature=kind))
    return found


def _authored(prim: Usd.Prim) -> Iterator[Usd.Attribute]:
    for attribute in prim.GetAuthoredAttributes():
        if attribute.HasAuthoredValue() and not attribute.GetName().startswith(_OTHERS):
            yield attribute


def _lacking(prim: Usd.Prim) -> Iterator[str]:
    builtin = prim.GetPrimDefinition()
    of_camera = prim.IsA(UsdGeom.Camera)
    for attribute in _authored(prim):
        name = attribute.GetName()
        dropped = name in _OF_CAMERAS if of_camera else name.startswith(_OF_LIGHTS)
        if dropped and name not in _READ:
            value = attribute.Get(_START)
            if value != builtin.GetAttributeFallbackValue(name):
                yield name
