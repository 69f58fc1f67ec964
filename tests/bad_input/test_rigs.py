"""Rigs that no take can be played on."""

import numpy as np
import pytest
from pxr import Sdf, Usd
from spoilt import Place, Refused


def test_a_rig_without_shapes(place: Place, refused: Refused) -> None:
    def strip(stage: Usd.Stage) -> None:
        for name in ("skel:blendShapes", "skel:blendShapeTargets"):
            stage.GetPrimAtPath("/Asset/Face/head").RemoveProperty(name)

    place.edit("rig.usda", strip)
    for command in (place.shot, place.process, ["rig", place / "rig.usda", "-o", place / "x.usda"]):
        message = refused(command)
        assert "no blend shapes" in message and str(place.folder) in message


def test_a_mesh_that_no_skeleton_plays(place: Place, refused: Refused) -> None:
    def unbind(stage: Usd.Stage) -> None:
        for prim in stage.Traverse():
            prim.RemoveProperty("skel:skeleton")

    place.edit("rig.usda", unbind)
    message = refused(place.process)
    assert "skel:skeleton" in message and "usdface rig" in message


def test_a_mesh_outside_the_default_prim(place: Place, refused: Refused) -> None:
    def move(stage: Usd.Stage) -> None:
        stage.SetDefaultPrim(stage.DefinePrim("/Other"))

    place.edit("rig.usda", move)
    message = refused(place.shot)
    assert "/Asset/Face/head" in message and "/Other" in message


@pytest.mark.parametrize(
    ("metric", "value"),
    [("upAxis", "X"), ("metersPerUnit", 0.0), ("metersPerUnit", -1.0), ("timeCodesPerSecond", 0.0)],
)
@pytest.mark.parametrize("name", ["rig", "take"])
def test_metrics_that_make_no_sense(
    place: Place, refused: Refused, name: str, metric: str, value: object
) -> None:
    layer = Sdf.Layer.FindOrOpen(str(place / f"{name}.usda"))
    layer.pseudoRoot.SetInfo(metric, value)
    layer.Save()
    message = refused(place.shot)
    assert metric in message and f"{name}.usda" in message


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_no_numbers(place: Place, refused: Refused, value: float) -> None:
    points = np.array(place.world.rig.meshes[0].points)
    points[7] = value
    place.edit(
        "rig.usda", lambda s: s.GetAttributeAtPath("/Asset/Face/head.points").Set(points.tolist())
    )
    assert "finite" in refused(place.shot)


def test_what_usd_warns_of_stays_off_standard_error(place: Place, refused: Refused) -> None:
    def aim(stage: Usd.Stage) -> None:
        stage.GetRelationshipAtPath("/Asset/Face/Skel.skel:animationSource").SetTargets(["/No"])

    place.edit("rig.usda", aim)
    place.bind(nose_tip="nase")
    assert "'nase'" in refused(place.shot)
