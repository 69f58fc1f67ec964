import numpy as np
import pytest
from clips import plays, weights_of_stage
from pxr import Usd, UsdSkel

from usdface.errors import InputError
from usdface.io.usd.clip_variants import (
    bound_animations,
    clip_stages,
    clips_and_losses,
    playing_animations,
)
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.takes import WeightsTake


def test_weights_come_in_seconds_by_time_codes_per_second(face_rig, tmp_path):
    given = WeightsTake(face_rig.shape_names, [0.5, 0.6, 0.7], np.eye(3, 4), 60.0)
    write_rig(face_rig, tmp_path / "rig.usda", plays(given))
    stage = open_stage(tmp_path / "rig.usda")
    stage.SetFramesPerSecond(24)  # for display only
    found = weights_of_stage(stage)
    assert found.names == given.names
    np.testing.assert_allclose(found.times, given.times, atol=1e-12)
    np.testing.assert_array_equal(found.weights, given.weights)


def test_a_rig_at_rest_has_no_weights_take(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "rig.usda")
    assert weights_of_stage(open_stage(tmp_path / "rig.usda")) is None


def test_a_sample_of_the_wrong_length_is_named(shared_data):
    with pytest.raises(InputError, match="2 blendShapeWeights for 1 blendShapes at time code 5"):
        weights_of_stage(open_stage(shared_data / "mayausd_morpher" / "morpher_box.usd"))


@pytest.mark.parametrize("place", ["/World", "/World/Face"])
def test_a_variant_set_above_a_skel_root_chooses_clips_as_well(face_rig, tmp_path, place):
    weights = np.zeros((3, len(face_rig.shape_names)))
    given = WeightsTake(face_rig.shape_names, [0.0, 0.1, 0.2], weights, 10.0)
    write_rig(face_rig, tmp_path / "rig.usda", plays(given))
    stage = open_stage(tmp_path / "rig.usda")
    face = stage.GetDefaultPrim().GetPath()
    shot = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    shot.DefinePrim("/World", "Xform")
    shot.DefinePrim("/World/Face").GetReferences().AddReference("rig.usda", face)
    (bound,) = bound_animations(shot)
    skeleton, sets = bound.skeleton.GetPrim(), shot.GetPrimAtPath(place).GetVariantSets()
    takes = sets.AddVariantSet("take")
    for name in ("Angry", "Sad"):
        takes.AddVariant(name)
        takes.SetVariantSelection(name)
        with takes.GetVariantEditContext():
            played = UsdSkel.Animation.Define(shot, f"/World/Face/{name}")
            UsdSkel.BindingAPI.Apply(skeleton).CreateAnimationSourceRel().SetTargets(
                [played.GetPath()]
            )
    found = [playing_animations(each)[0].name for each in clip_stages(shot)]
    assert found == ["Sad", "Angry"]


def test_a_variant_without_the_character_is_no_clip(face_rig, tmp_path):
    weights = np.zeros((3, len(face_rig.shape_names)))
    given = WeightsTake(face_rig.shape_names, [0.0, 0.1, 0.2], weights, 10.0)
    write_rig(face_rig, tmp_path / "rig.usda", plays(given))
    face = open_stage(tmp_path / "rig.usda").GetDefaultPrim().GetPath()
    shot = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    levels = shot.DefinePrim("/World", "Xform").GetVariantSets().AddVariantSet("lod")
    levels.AddVariant("none")
    levels.AddVariant("proxy")
    levels.SetVariantSelection("proxy")
    with levels.GetVariantEditContext():
        shot.DefinePrim("/World/Face", "Sphere")
    levels.AddVariant("high")
    levels.SetVariantSelection("high")
    with levels.GetVariantEditContext():
        shot.DefinePrim("/World/Face").GetReferences().AddReference("rig.usda", face)
    stages, findings = clips_and_losses(shot)
    assert len(stages) == 1
    assert not findings


def test_a_variant_set_that_chooses_characters_is_none_of_clips(face_rig, tmp_path):
    weights = np.zeros((3, len(face_rig.shape_names)))
    given = WeightsTake(face_rig.shape_names, [0.0, 0.1, 0.2], weights, 10.0)
    write_rig(face_rig, tmp_path / "rig.usda", plays(given))
    face = open_stage(tmp_path / "rig.usda").GetDefaultPrim().GetPath()
    shot = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    characters = shot.DefinePrim("/World", "Xform").GetVariantSets().AddVariantSet("character")
    for name in ("Mia", "Tom"):
        characters.AddVariant(name)
        characters.SetVariantSelection(name)
        with characters.GetVariantEditContext():
            prim = shot.DefinePrim(f"/World/{name}")
            prim.GetReferences().AddReference("rig.usda", face)
    assert len(list(clip_stages(shot))) == 1


def test_a_variant_that_replaces_the_samples_of_a_clip_is_announced(face_rig, tmp_path):
    """Another payload with an animation of the same path; the look changes none."""
    times, count = [0.0, 0.1, 0.2], len(face_rig.shape_names)
    for name, value in (("angry", 0.5), ("sad", 0.25)):
        weights = np.full((3, count), value)
        take = WeightsTake(face_rig.shape_names, times, weights, 10.0)
        write_rig(face_rig, tmp_path / f"{name}.usda", plays(take))
    face = open_stage(tmp_path / "sad.usda").GetDefaultPrim().GetPath()
    shot = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    sets = shot.DefinePrim("/World", "Xform").GetVariantSets()
    chosen = {"take": ("angry", "sad"), "look": ("red", "blue")}
    for set_name, variants in chosen.items():
        added = sets.AddVariantSet(set_name)
        for variant in variants:
            added.AddVariant(variant)
            added.SetVariantSelection(variant)
            with added.GetVariantEditContext():
                prim = shot.DefinePrim("/World/Face")
                if set_name == "take":
                    prim.GetPayloads().AddPayload(f"{variant}.usda", face)
    stages, (lost,) = clips_and_losses(shot)
    assert stages == [shot]
    assert lost.code == "ANIMATION_DROPPED" and lost.values == {"variants": ["take=angry"]}
    assert lost in animated_rig(shot)[2]


def test_a_clip_of_an_instance_is_one_in_all_variants(face_rig, tmp_path):
    """Prototypes are numbered anew where a variant brings in another instance."""
    times, count = [0.0, 0.1, 0.2], len(face_rig.shape_names)
    take = WeightsTake(face_rig.shape_names, times, np.eye(3, count), 10.0)
    write_rig(face_rig, tmp_path / "face.usda", plays(take))
    for name in ("prop", "other"):
        prop = Usd.Stage.CreateNew(str(tmp_path / f"{name}.usda"))
        prop.SetDefaultPrim(prop.DefinePrim("/Prop"))
        prop.DefinePrim("/Prop/Part")
        prop.Save()
    shot = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    looks = shot.DefinePrim("/World", "Xform").GetVariantSets().AddVariantSet("look")
    for look, props in {"bare": (), "full": ("prop", "other")}.items():
        looks.AddVariant(look)
        looks.SetVariantSelection(look)
        with looks.GetVariantEditContext():
            for name in props:
                prim = shot.DefinePrim(f"/World/a_{name}")
                prim.GetReferences().AddReference(f"{name}.usda")
                prim.SetInstanceable(True)
    looks.SetVariantSelection("bare")
    prim = shot.DefinePrim("/World/Hero")
    prim.GetReferences().AddReference("face.usda")
    prim.SetInstanceable(True)
    assert clips_and_losses(shot) == ([shot], [])
    (path,) = playing_animations(shot)
    assert path.HasPrefix("/World/Hero") and shot.GetPrimAtPath(path).IsA(UsdSkel.Animation)


def test_libraries_of_animations_and_poses_are_announced(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "face.usda")
    shot = Usd.Stage.Open(str(tmp_path / "face.usda"))
    found = {}
    for name, weights in (("Laugh", (0.0, 1.0)), ("Joy", (1.0,)), ("Rest", (0.0,))):
        path = f"/Library/{name}"  # beside the character
        animation = UsdSkel.Animation.Define(shot, path)
        animation.CreateBlendShapesAttr(face_rig.shape_names[:1])
        given = animation.CreateBlendShapeWeightsAttr()
        for code, weight in enumerate(weights):
            given.Set([weight], code) if len(weights) > 1 else given.Set([weight])
        found[path] = [f.code for f in animated_rig(shot)[2] if f.where == path]
    assert found == {
        "/Library/Laugh": ["ANIMATION_DROPPED"],
        "/Library/Joy": ["ANIMATION_DROPPED"],
        "/Library/Rest": [],
    }
    take = shot.DefinePrim("/Shot").CreateRelationship("usdface:take")
    take.SetTargets(["/Library/Laugh"])  # what a shot was made of is in its result
    assert [f.where for f in animated_rig(shot)[2] if f.code == "ANIMATION_DROPPED"] == [
        "/Library/Joy"
    ]
