"""Names of blend shapes with a prefix or a suffix that nearly all of them share."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.face.curve_mapping import rename_weights
from usdface.face.curves_by_unit import curves_by_unit
from usdface.face.expression_poses import expressions_for, units_of
from usdface.face.gaze_curves import gaze_curves_of
from usdface.face.plain_names import plain_names, report_affixes, shape_keys
from usdface.face.symmetry import symmetric_pairs
from usdface.facs.shape_claims import claims_of
from usdface.takes import WeightsTake

ARKIT = (
    *("jawOpen", "jawLeft", "jawRight", "browInnerUp", "browDown_L", "browDown_R", "mouthClose"),
    *("mouthSmile_L", "mouthSmile_R", "eyeBlink_L", "eyeBlink_R", "eyeLookUp_L", "eyeLookUp_R"),
    *("cheekSquint_L", "cheekSquint_R", "mouthFrown_L", "mouthFrown_R", "hair"),
)
STUDIOS = ("M_{}_v2", "CHR_face_{}_geo", "Hero__{}", "head_bs_{}", "Hero:{}", "bs1.{}_v3", "v2{}")
STUDIOS += ("A38 {} 100", "Hana_{}", "facs.{}", "HERO_FACE_{}_SHAPE")


@pytest.mark.parametrize("form", STUDIOS)
def test_a_studios_names_mean_the_same_movements(form: str) -> None:
    names = tuple(form.format(name) for name in ARKIT)
    own = dict(zip(ARKIT, names, strict=True))
    assert shape_keys(names)[:-1] == shape_keys(ARKIT)[:-1]
    assert units_of(names) == {own[name]: units for name, units in units_of(ARKIT).items()}
    assert claims_of(names) == {own[name]: each for name, each in claims_of(ARKIT).items()}
    assert gaze_curves_of(names) == {own[name] for name in gaze_curves_of(ARKIT)}
    np.testing.assert_array_equal(symmetric_pairs(names), symmetric_pairs(ARKIT))
    expressions, _ = expressions_for(names)
    assert [e.shapes for e in expressions] == [
        tuple(own[name] for name in e.shapes) for e in expressions_for(ARKIT)[0]
    ]


@pytest.mark.parametrize("form", STUDIOS)
def test_curves_drive_a_studios_blend_shapes_and_the_other_way_round(form: str) -> None:
    curves = tuple(name.replace("_L", "Left").replace("_R", "Right") for name in ARKIT[:-1])
    names = tuple(form.format(name) for name in ARKIT)
    weights = np.linspace(0.0, 1.0, len(curves))[None]
    renamed, findings = rename_weights(WeightsTake(curves, np.zeros(1), weights), names)
    assert renamed.names == names and not findings
    np.testing.assert_allclose(renamed.weights[:, :-1], weights)
    back, _ = rename_weights(WeightsTake(names, np.zeros(1), renamed.weights), curves)
    np.testing.assert_allclose(back.weights, weights)


def test_curves_of_a_studio_drive_action_units() -> None:
    found = curves_by_unit(("Take1_jawOpen", "Take1_mouthClose"), ("Hero_mouth-open", "Hero_x"))
    assert found == {
        "Take1_jawOpen": {"Hero_mouth-open": 0.8},
        "Take1_mouthClose": {"Hero_mouth-open": -0.8},
    }


@pytest.mark.parametrize(
    "names",
    [
        ("mouthJoy", "mouthAngry", "mouthSad"),  # of the mouth alone
        ("Brows_happy", "Brows_sad", "Brows_fear"),
        ("Eye_A", "Eye_E", "Eye_I", "Eye_O"),  # letters count things
        ("shape_a", "shape_b", "shape_e"),
        ("jawOpen", "Hero_jawOpen", "Hero_mouthSmile_L", "Hero_x"),  # would be two of one name
        ("half_jawOpen", "jawForward", "mouthFunnel", "mouthPucker"),  # a word of one name
        ("eyeBlink_L", "eyeLookUp_L", "eyeSquint_L"),  # a side is none
        ("noBlink",),
        ("horns_v2", "tail_v2"),
        (),
    ],
)
def test_words_that_mean_something_stay(names: tuple[str, ...]) -> None:
    assert dict(plain_names(names)) == {name: name for name in names}


def test_helpers_need_no_prefix() -> None:
    plain = plain_names(("Hero_jawOpen", "Hero_mouthFunnel", "Hero_mouthPucker", "bulge"))
    assert list(plain.values()) == ["jaw_open", "mouth_funnel", "mouth_pucker", "bulge"]


def test_a_rig_with_such_names_is_reported_and_keeps_them() -> None:
    rig = make_world().rig
    assert not report_affixes(rig)
    named = dict(zip(rig.shape_names, ("X_jawOpen_v2", "X_smile_v2", "X_joy_v2"), strict=False))
    (mesh,) = rig.meshes
    shapes = (replace(s, name=named.get(s.name, f"X_{s.name}_v2")) for s in mesh.shapes)
    studio = replace(rig, meshes=(replace(mesh, shapes=tuple(shapes)),))
    (found,) = report_affixes(studio)
    assert found.code == "SHAPE_NAMES_AFFIXED"
    assert "X_jawOpen_v2" in found.message and "jaw_open" in found.message
    assert "X_jawOpen_v2" in studio.shape_names


def test_tongue_and_teeth_are_no_prefix_of_a_studio():
    for part in ("tongue", "teeth"):
        names = (f"{part}_jawOpen", f"{part}_out", f"{part}_up", f"{part}_down")
        assert dict(plain_names(names)) == {name: name for name in names}
