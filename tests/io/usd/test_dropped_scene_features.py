"""Features of cameras and lights that a scene does not keep are announced."""

from pxr import Sdf, Usd, UsdGeom, UsdLux

from usdface.findings import Finding
from usdface.io.usd.dropped_scene_features import report_dropped_features


def reported(prim: Usd.Prim) -> list[tuple[str, object]]:
    def names(found: Finding) -> object:
        return found.values.get("channels") or found.values.get("attributes")

    return [(f.code, names(f)) for f in report_dropped_features(prim)]


def test_a_zoom_a_shifted_window_and_depth_of_field_are_announced() -> None:
    stage = Usd.Stage.CreateInMemory()
    camera = UsdGeom.Camera.Define(stage, "/Cam")
    camera.CreateFocusDistanceAttr(3.0)
    camera.CreateFStopAttr(0.0)  # all is sharp
    for code in (1.0, 2.0):  # exporters write the same value at each frame
        camera.CreateFocalLengthAttr().Set(35.0, code)
    assert reported(camera.GetPrim()) == []
    camera.GetFocalLengthAttr().Set(85.0, 3.0)
    camera.CreateHorizontalApertureOffsetAttr(2.0)
    camera.GetFStopAttr().Set(2.8)
    assert reported(camera.GetPrim()) == [
        ("ANIMATION_DROPPED", ["focalLength"]),
        ("FEATURE_DROPPED", ["fStop", "horizontalApertureOffset"]),
    ]


def test_a_light_that_flickers_and_its_profile_are_announced() -> None:
    stage = Usd.Stage.CreateInMemory()
    light = UsdLux.SphereLight.Define(stage, "/Key")
    light.CreateSpecularAttr(1.0)
    light.CreateColorAttr((1, 0, 0))
    assert reported(light.GetPrim()) == []
    for code, intensity in ((1.0, 1.0), (2.0, 5.0)):
        light.CreateIntensityAttr().Set(intensity, code)
    for code, seen in ((1.0, "inherited"), (2.0, "invisible")):
        light.CreateVisibilityAttr().Set(seen, code)
    light.GetSpecularAttr().Set(0.0)
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingIesFileAttr(Sdf.AssetPath("lamp.ies"))
    assert reported(light.GetPrim()) == [
        ("ANIMATION_DROPPED", ["inputs:intensity", "visibility"]),
        ("FEATURE_DROPPED", ["inputs:shaping:ies:file", "inputs:specular"]),
    ]
