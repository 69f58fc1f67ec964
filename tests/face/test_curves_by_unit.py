import pytest

from usdface.face.curves_by_unit import curves_by_unit
from usdface.face.facs_names import ARKIT, MAKEHUMAN, ActionUnit


@pytest.mark.parametrize(
    ("curves", "shapes", "expected"),
    [
        (["EyeBlinkLeft"], ["eye-left-closure"], {"EyeBlinkLeft": {"eye-left-closure": 1.0}}),
        (["eyeBlink_R"], ["AU43_L", "AU43_R"], {"eyeBlink_R": {"AU43_R": 1.0}}),
        (["jawOpen"], ["mouth-open"], {"jawOpen": {"mouth-open": 0.8}}),
        (
            ["browInnerUp"],
            ["eyebrows-left-inner-up", "eyebrows-right-inner-up"],
            {"browInnerUp": {"eyebrows-left-inner-up": 1.0, "eyebrows-right-inner-up": 1.0}},
        ),
        # Both eyes turn to a side, which the names of VRM's presets have.
        (
            ["eyeLookOutLeft", "eyeLookInRight", "eyeLookInLeft", "eyeLookOut_R"],
            ["lookLeft", "lookRight"],
            {
                "eyeLookOutLeft": {"lookLeft": 0.5},
                "eyeLookInRight": {"lookLeft": 0.5},
                "eyeLookInLeft": {"lookRight": 0.5},
                "eyeLookOut_R": {"lookRight": 0.5},
            },
        ),
        (
            ["lookLeft"],
            ["eyeLookOutLeft", "eyeLookInLeft", "eyeLookInRight", "eyeLookOutRight"],
            {"lookLeft": {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}},
        ),
        # Other spellings of FACS.
        (["AU06_L", "AU12_L"], ["AU6_L", "AU6_R"], {"AU06_L": {"AU6_L": 1.0}}),
        (["AU12_L"], ["FACS_AU12_left"], {"AU12_L": {"FACS_AU12_left": 1.0}}),
        (
            ["eyeLookOutLeft", "eyeLookInRight", "eyeLookOutRight"],
            ["AU61", "AU62"],
            {
                "eyeLookOutLeft": {"AU61": 0.5},
                "eyeLookInRight": {"AU61": 0.5},
                "eyeLookOutRight": {"AU62": 1.0},
            },
        ),
        # The other way round.
        (
            ["mouth-corner-puller", "AU04_L"],
            ["mouthSmileLeft", "mouthSmileRight", "browDownLeft", "browDownRight"],
            {
                "mouth-corner-puller": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
                "AU04_L": {"browDownLeft": 1.0},
            },
        ),
        (["tongueOut", "headYaw"], ["mouth-open", "anything"], {}),
        ([], ["mouth-open"], {}),
        (["jawOpen"], [], {}),
    ],
)
def test_a_curve_drives_the_blend_shapes_of_its_unit(
    curves: list[str], shapes: list[str], expected: dict[str, dict[str, float]]
) -> None:
    assert curves_by_unit(curves, shapes) == expected


def test_two_sides_drive_a_shape_without_one_by_their_mean() -> None:
    smiles = curves_by_unit(["mouthSmileLeft", "mouthSmileRight"], ["mouth-corner-puller"])
    assert smiles["mouthSmileLeft"] == smiles["mouthSmileRight"] == {"mouth-corner-puller": 0.5}
    assert curves_by_unit(["mouthSmileLeft"], ["mouth-corner-puller"]) == {
        "mouthSmileLeft": {"mouth-corner-puller": 1.0}
    }


def test_a_unit_that_a_rig_has_whole_and_in_halves_is_shown_once() -> None:
    shapes = ["AU12", "AU12_L", "AU12_R"]
    halves = curves_by_unit(["mouthSmileLeft", "mouthSmileRight"], shapes)
    assert halves == {"mouthSmileLeft": {"AU12_L": 1.0}, "mouthSmileRight": {"AU12_R": 1.0}}
    assert curves_by_unit(["mouth-corner-puller"], shapes) == {"mouth-corner-puller": {"AU12": 1.0}}


@pytest.mark.parametrize("before", ["", "Face.M_F00_000_00_"])
def test_mouths_and_lids_of_vroid(before: str) -> None:
    lids = [f"{before}Fcl_EYE_Close", f"{before}Fcl_EYE_Close_L", f"{before}Fcl_EYE_Close_R"]
    found = curves_by_unit(["JawOpen", "EyeBlinkLeft"], [f"{before}Fcl_MTH_A", *lids])
    assert found == {"JawOpen": {f"{before}Fcl_MTH_A": 1.0}, "EyeBlinkLeft": {lids[1]: 1.0}}
    assert curves_by_unit(["JawOpen"], ["A", "O"]) == {"JawOpen": {"A": 1.0}}


def test_no_blend_shape_is_moved_for_two_units() -> None:
    """A nose that wrinkles and a lip that rises are recorded as two curves."""
    shapes = ["mouth-elevation", "nose-left-elevation"]
    both = curves_by_unit(["noseSneerLeft", "mouthUpperUpLeft"], shapes)
    assert both == {
        "noseSneerLeft": {"nose-left-elevation": 1.0},
        "mouthUpperUpLeft": {"mouth-elevation": 1.0},
    }
    alone = curves_by_unit(["noseSneerLeft"], shapes)
    assert alone == {"noseSneerLeft": {"mouth-elevation": 0.8, "nose-left-elevation": 1.0}}


def test_lips_that_a_phone_closes_take_back_the_jaw() -> None:
    found = curves_by_unit(["jawOpen", "mouthClose"], ["mouth-open"])
    assert found["mouthClose"] == {"mouth-open": -0.8}
    assert "mouthClose" not in curves_by_unit(["mouthClose"], ["mouth-open"])
    named = {"JawOpen": {"mouth-open": 0.5, "chin": 0.2}}
    taken = curves_by_unit(["mouthClose"], [], named)
    assert taken == {"mouthClose": {"mouth-open": -0.5, "chin": -0.2}}
    assert curves_by_unit(["mouthClose"], [], {"jawOpen": {}}) == {}


def test_within_a_convention_nothing_replaces_a_missing_shape() -> None:
    others = [name for name, _ in ARKIT.names(ActionUnit(9)) if not name.startswith("noseSneer")]
    assert others and curves_by_unit(["noseSneerLeft"], others) == {}


def test_every_unit_of_makehuman_is_reached_by_a_phone() -> None:
    """No curve of a phone is MakeHuman's lip tightener: its pressed lips are the presser."""
    phone = [name for unit in ARKIT.units for name, _ in ARKIT.names(ActionUnit(unit))]
    shapes = {name for unit in MAKEHUMAN.units for name, _ in MAKEHUMAN.names(ActionUnit(unit))}
    found = curves_by_unit(phone, sorted(shapes))
    reached = {shape for driven in found.values() for shape in driven}
    assert shapes - reached == {"mouth-eversion", "mouth-parling"}
    for shape in reached:
        assert 0.5 <= sum(max(driven.get(shape, 0.0), 0.0) for driven in found.values()) <= 1.0
