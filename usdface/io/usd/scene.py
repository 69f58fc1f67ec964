"""Cameras and lights of a USD stage, read and written.

UsdLux has luminance L [nit], glTF illuminance and intensity. A sphere of radius r is seen from afar
with the luminous intensity L pi r^2; if it is normalised by its surface 4 pi r^2 that is L / 4. A
distant light whose strength is normalised lights with L [lx]; else with L pi sin^2 of half its
angle. A scene unit counts as a metre by the stage's metersPerUnit.

Source: OpenUSD, UsdGeomCamera (apertures are tenths of a scene unit) and UsdLux (quantities and
units; cone softness fades from the angle times one minus the softness).
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import mean_scale
from usdface.io.prim_names import prim_names
from usdface.io.transforms import rigid
from usdface.io.usd.conversion_metadata import CONTENT_NAME, read_metadata, write_metadata
from usdface.io.usd.dropped_scene_features import report_dropped_features
from usdface.io.usd.extras import read_extras, write_extras
from usdface.io.usd.prim_walks import prims_without
from usdface.scene import Camera, Light

__all__ = ["read_scene", "write_scene"]

_START = Usd.TimeCode.EarliestTime()
_FAR = 1e6  # USD's own default; it has no infinity
_APERTURE = 15.2908  # USD's default height of the film
_RADIUS = 0.001  # [m] of a light that has no size


# -- in ------------------------------------------------------------------------------------


def read_scene(
    stage: Usd.Stage, si: FloatArray
) -> tuple[tuple[Camera, ...], tuple[Light, ...], list[Finding]]:
    """Return the cameras and lights of a stage where they stand at its first time.

    `si` (4, 4) leads from stage space to metres, Y up. Lights that glTF has nothing like are left
    out (FEATURE_DROPPED), as is motion (ANIMATION_DROPPED).
    """
    cameras: list[Camera] = []
    lights: list[Light] = []
    found: list[Finding] = []
    xforms = UsdGeom.XformCache(_START)
    # Prototypes of instancers are not shown where they stand.
    for prim in prims_without(stage.GetPseudoRoot(), UsdGeom.PointInstancer):
        shines = prim.HasAPI(UsdLux.LightAPI)
        if not prim.IsA(UsdGeom.Camera) and not shines:
            continue
        where = str(prim.GetPath())
        if UsdGeom.Imageable(prim).ComputeVisibility(_START) == UsdGeom.Tokens.invisible:
            message = "the {type} is left out: it is invisible"
            kind = "light" if shines else "camera"
            found.append(finding("FEATURE_DROPPED", where, message, kind, feature=kind))
            continue
        matrix = np.array(xforms.GetLocalToWorldTransform(prim), np.float64) @ si
        if not np.isfinite(matrix).all() or not np.linalg.det(matrix[:3, :3]):
            found.append(
                finding(
                    "FEATURE_DROPPED",
                    where,
                    "its transform is no place; left out",
                    feature="transform",
                )
            )
            continue
        found += report_dropped_features(prim)
        thing = _light(prim, matrix, found) if shines else _camera(prim, rigid(matrix), si)
        if thing is None:
            continue
        if not _is_allowed(thing):
            message = "a {type} with numbers that glTF does not allow; it is left out"
            kind = "light" if shines else "camera"
            found.append(finding("FEATURE_DROPPED", where, message, kind, feature=kind))
            continue
        extras, new_findings = read_extras(prim)
        found += new_findings
        own = str(read_metadata(prim).get(CONTENT_NAME, ""))
        if isinstance(thing, Camera):
            cameras.append(replace(thing, extras=extras, content_name=own))
        else:
            lights.append(replace(thing, extras=extras, content_name=own))
    return tuple(cameras), tuple(lights), found


def _is_allowed(thing: Camera | Light) -> bool:
    """Return whether glTF allows the numbers (2.0, 5.12 to 5.14, KHR_lights_punctual); NaN no."""
    if isinstance(thing, Light):
        return 0 <= thing.intensity < math.inf
    widest = math.pi if thing.perspective else math.inf
    return 0 < thing.height < widest and 0 <= thing.near < thing.far


def _name(prim: Usd.Prim) -> str:
    return str(prim.GetDisplayName() or prim.GetName())


def _camera(prim: Usd.Prim, matrix: FloatArray, si: FloatArray) -> Camera:
    seen = UsdGeom.Camera(prim).GetCamera(_START)
    clip, notes, unit = seen.clippingRange, read_metadata(prim), mean_scale(si[:3, :3])
    far = math.inf if notes.get("endless") else clip.max * unit
    aspect = 0.0 if notes.get("anyAspect") else seen.aspectRatio
    aspect = aspect if 0 < aspect < 1e6 else 0.0  # of an aperture without height
    if seen.projection == Gf.Camera.Perspective:
        height = math.radians(seen.GetFieldOfView(Gf.Camera.FOVVertical))
    else:
        height = seen.verticalAperture * Gf.Camera.APERTURE_UNIT * unit
    deep = seen.projection == Gf.Camera.Perspective
    near = max(clip.min * unit, 1e-6 if deep else 0.0)
    return Camera(_name(prim), matrix, height, aspect, near, far, deep)


def _light(prim: Usd.Prim, matrix: FloatArray, found: list[Finding]) -> Light | None:
    api, where = UsdLux.LightAPI(prim), str(prim.GetPath())
    colour = np.array(api.GetColorAttr().Get(_START), np.float64)
    if api.GetEnableColorTemperatureAttr().Get(_START):
        kelvin = api.GetColorTemperatureAttr().Get(_START)
        colour *= np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    with np.errstate(over="ignore"):
        exposure = float(np.exp2(api.GetExposureAttr().Get(_START)))
    strength = api.GetIntensityAttr().Get(_START) * exposure
    strength *= float(np.maximum(colour.max(), 0.0))
    tint = (colour / colour.max()).clip(0, 1).tolist() if colour.max() > 0 else [0.0, 0.0, 0.0]
    normal = bool(api.GetNormalizeAttr().Get(_START))
    hue, name = (tint[0], tint[1], tint[2]), _name(prim)
    if prim.IsA(UsdLux.DistantLight):
        half = math.radians(UsdLux.DistantLight(prim).GetAngleAttr().Get(_START)) / 2
        lux = strength if normal or half == 0 else strength * math.pi * math.sin(half) ** 2
        return Light(name, "directional", rigid(matrix), hue, lux)
    if not prim.IsA(UsdLux.SphereLight):
        message = (
            "a {type} is left out; points, spots and distant lights are kept, as glTF has them"
        )
        found.append(
            finding("FEATURE_DROPPED", where, message, str(prim.GetTypeName()), feature="light")
        )
        return None
    radius = UsdLux.SphereLight(prim).GetRadiusAttr().Get(_START) * mean_scale(matrix[:3, :3])
    candela = strength / 4 if normal else strength * math.pi * radius**2
    reach = float(read_metadata(prim).get("range", math.inf))
    shaping = UsdLux.ShapingAPI(prim)
    angle = shaping.GetShapingConeAngleAttr().Get(_START) if _is_shaped(prim) else None
    if angle is None or angle >= 180:
        return Light(name, "point", rigid(matrix), hue, candela, reach=reach)
    soft = min(max(shaping.GetShapingConeSoftnessAttr().Get(_START) or 0.0, 0.0), 1.0)
    outer = math.radians(angle)
    if outer > math.pi / 2:
        message = "a cone of {angle_degrees:g} degrees becomes one of 90, the widest of glTF"
        found.append(finding("FEATURE_APPROXIMATED", where, message, angle, feature="cone_angle"))
        outer = math.pi / 2
    return Light(name, "spot", rigid(matrix), hue, candela, outer * (1 - soft), outer, reach)


def _is_shaped(prim: Usd.Prim) -> bool:
    return bool(prim.HasAPI(UsdLux.ShapingAPI))


# -- out -----------------------------------------------------------------------------------


def write_scene(
    stage: Usd.Stage, cameras: Sequence[Camera], lights: Sequence[Light]
) -> list[Finding]:
    """Define cameras and lights in the scopes ``/Asset/Cameras`` and ``/Asset/Lights``.

    The stage is in metres, Y up.
    """
    found: list[Finding] = []
    kinds: list[tuple[str, Sequence[Camera | Light]]] = [("Cameras", cameras), ("Lights", lights)]
    for scope, things in kinds:
        if not things:
            continue
        top = UsdGeom.Scope.Define(stage, f"/Asset/{scope}").GetPath()
        for name, thing in zip(prim_names(t.name for t in things), things, strict=True):
            path = top.AppendChild(name)
            if isinstance(thing, Camera):
                prim = _write_camera(stage, path, thing)
            else:
                prim = _write_light(stage, path, thing, found)
            place = Gf.Matrix4d(*thing.matrix.ravel().tolist())
            UsdGeom.Xformable(prim).AddTransformOp().Set(place)
            if name != thing.name:
                prim.SetDisplayName(thing.name)
                found.append(finding("NAME_CHANGED", str(path), "was {original!r}", thing.name))
            found += write_extras(prim, thing.extras)
            if thing.content_name:
                write_metadata(prim, CONTENT_NAME, thing.content_name)
    return found


def _write_camera(stage: Usd.Stage, path: Sdf.Path, camera: Camera) -> Usd.Prim:
    made = UsdGeom.Camera.Define(stage, path)
    aspect = camera.aspect or 16 / 9
    if camera.perspective:
        made.CreateProjectionAttr(UsdGeom.Tokens.perspective)
        high = _APERTURE
        made.CreateFocalLengthAttr(high / (2 * math.tan(camera.height / 2)))
    else:
        made.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
        high = camera.height / Gf.Camera.APERTURE_UNIT
    made.CreateVerticalApertureAttr(high)
    made.CreateHorizontalApertureAttr(high * aspect)
    far = camera.far if math.isfinite(camera.far) else _FAR
    made.CreateClippingRangeAttr(Gf.Vec2f(camera.near, far))
    if not camera.aspect:
        write_metadata(made.GetPrim(), "anyAspect", True)
    if not math.isfinite(camera.far):
        write_metadata(made.GetPrim(), "endless", True)
    return made.GetPrim()


def _write_light(stage: Usd.Stage, path: Sdf.Path, light: Light, found: list[Finding]) -> Usd.Prim:
    if light.kind == "directional":
        distant = UsdLux.DistantLight.Define(stage, path)
        distant.CreateAngleAttr(0.0)
        prim, strength = distant.GetPrim(), light.intensity
    else:
        sphere = UsdLux.SphereLight.Define(stage, path)
        sphere.CreateRadiusAttr(_RADIUS)
        sphere.CreateTreatAsPointAttr(True)
        prim, strength = sphere.GetPrim(), 4 * light.intensity
    api = UsdLux.LightAPI(prim)
    api.CreateNormalizeAttr(True)
    api.CreateIntensityAttr(strength)
    api.CreateColorAttr(Gf.Vec3f(*light.colour))
    if light.kind == "spot":
        shaping = UsdLux.ShapingAPI.Apply(prim)
        shaping.CreateShapingConeAngleAttr(math.degrees(light.outer))
        shaping.CreateShapingConeSoftnessAttr(1 - light.inner / light.outer if light.outer else 0.0)
        message = "glTF and UsdLux let the light of a spot fade by different curves"
        found.append(finding("FEATURE_APPROXIMATED", str(path), message, feature="spot_falloff"))
    if math.isfinite(light.reach):
        write_metadata(prim, "range", light.reach)
        message = "UsdLux lights have no range; it is only noted"
        found.append(finding("FEATURE_APPROXIMATED", str(path), message, feature="light_range"))
    return prim
