"""Shots with a broken part."""

import pytest
from spoilt import Place, Refused


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("corner_r_y IS raised, ", "corner_r_y IS high, ", "'high'"),
        ("corner_r_y IS raised, ", "corner_r_y, ", "/Shot/Fuzzy/rule_"),
        ("IF MOST OF (corner_l_y", "IF MOST OF (corner_z_z", "corner_z_z"),
        ('usdface:head:mode = "solve"', 'usdface:head:mode = "guess"', "guess"),
        (
            "usdface:neutral:range = (0, 3)",
            "usdface:neutral:range = (30, 300)",
            "shot.usda: prim </Shot/Retarget>: usdface:neutral:range is (30, 300), which is not "
            "within the frames of the take take.trc: 0 to 39",
        ),
        (
            "usdface:neutral:range = (0, 3)",
            "usdface:neutral:range = (3, 0)",
            "shot.usda: prim </Shot/Retarget>: usdface:neutral:range is (3, 0), which is reversed",
        ),
        ("usdface:map:radius = 3", "usdface:map:radius = -3", "radius"),
        ("usdface:map:radius = 3", "usdface:map:radius = nan", "radius"),
        ("</Shot/Character/Face/head>", "</Shot/Character/Face/kopf>", "kopf"),
        ("</Shot/Capture/Take>", "</Shot/Capture/Tak>", "/Shot/Capture/Tak"),
        ("</Shot/Fuzzy>", "</Shot/Fuzz>", "/Shot/Fuzz"),
        ("rel usdface:take = </Shot/Capture/Take>", "rel usdface:take", "usdface:take"),
        ("usdface:weights = [0.9", "usdface:weights = [1.9", "/Shot/Expressions/"),
        ("usdface:weights = [0.9, ", "usdface:weights = [", "/Shot/Expressions/"),
    ],
)
def test_a_shot_with_a_broken_part(
    place: Place, refused: Refused, old: str, new: str, message: str
) -> None:
    place.replace("shot.usda", old, new)
    assert message in refused(place.process)


def test_a_character_that_is_an_instance(place: Place, refused: Refused) -> None:
    place.edit("shot.usda", lambda s: s.GetPrimAtPath("/Shot/Character").SetInstanceable(True))
    assert "instanceable = false" in refused(place.process)


def test_a_shot_inside_an_instance(place: Place, refused: Refused) -> None:
    place.edit("shot.usda", lambda s: s.GetPrimAtPath("/Shot").SetInstanceable(True))
    scene = place.folder / "scene.usda"
    scene.write_text('#usda 1.0\ndef "World" (references = @shot.usda@)\n{\n}\n')
    told = refused(["process", scene])
    assert "/World/Retarget is inside an instance" in told and "instanceable = false" in told


def test_two_shots_in_one_scene(place: Place, refused: Refused) -> None:
    scene = place.folder / "scene.usda"
    prims = (f'def "{name}" (references = @shot.usda@)\n{{\n}}\n' for name in "AB")
    scene.write_text("#usda 1.0\n" + "".join(prims))
    told = refused(["process", scene])
    assert (
        "/A/Retarget, /B/Retarget" in told and "expected one; name the file of one of them" in told
    )
