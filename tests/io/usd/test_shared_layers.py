"""Layers that shots share: one change is a change in every shot, and nothing is lost by sharing."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import make_world

from usdface.content_digest import content_digest
from usdface.errors import InputError
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.usd.shot import read_shot
from usdface.io.usd.take_write import write_take
from usdface.pipeline import make_shot, process
from usdface.takes import WeightsTake

CALIBRATION = {"shapes": {"jawOpen": {"gain": 1.2}, "mouthSmileLeft": {"gain": 0.9}}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = make_world().write(tmp_path / "show")
    (folder / "anna.json").write_text(json.dumps(CALIBRATION))
    (folder / "shots").mkdir()
    return folder


def shoot(folder: Path, name: str, *, shared: bool = True, **more: object) -> set[str]:
    layers = {
        "performer_layer": folder / "anna.usda",
        "character_layer": folder / "sets/mia.usda",
    }
    result = make_shot(
        *(folder / n for n in ("rig.usda", "take.usda", f"shots/{name}.usda")),
        bind=folder / "bind.json",
        calibration=folder / "anna.json",
        **(layers if shared else {}),
        **more,  # type: ignore[arg-type]
    )
    return {finding.code for finding in result.findings}


def content(path: Path) -> str:
    staged, _ = read_shot(Usd.Stage.Open(str(path)), str(path))
    shot = staged.shot
    return content_digest(replace(shot, rig=replace(shot.rig, name="", source="")))  # the file


def test_a_shot_with_shared_layers_is_the_shot_without(folder: Path) -> None:
    shoot(folder, "a")
    shoot(folder, "whole", shared=False)
    assert content(folder / "shots/a.usda") == content(folder / "shots/whole.usda")
    shot = (folder / "shots/a.usda").read_text()
    for name in ("usdface:calibration", "usdface:bind:points", "usdface:text", "rig.usda"):
        assert name not in shot
    assert "usdface:neutral:range" in shot and "take.usda" in shot
    performer = (folder / "anna.usda").read_text()
    assert "usdface:calibration:gains" in performer and "usdface:bind" not in performer
    character = (folder / "sets/mia.usda").read_text()
    assert "@../rig.usda@" in character and "usdface:madeWith" in character.replace(
        "usdface = {\n", "usdface:"
    ).replace("dictionary ", "").replace(" ", "")


@pytest.mark.slow
def test_a_change_of_a_shared_layer_is_one_of_every_shot(folder: Path) -> None:
    for name in ("a", "b"):
        assert "LAYER_KEPT" not in shoot(folder, name)
    before = [content(folder / f"shots/{name}.usda") for name in ("a", "b")]
    assert before[0] == before[1]
    layer = Sdf.Layer.FindOrOpen(str(folder / "anna.usda"))
    layer.GetAttributeAtPath("/Shot/Retarget.usdface:calibration:gains").default = [1.4, 0.9]
    layer.Save()
    after = [content(folder / f"shots/{name}.usda") for name in ("a", "b")]
    assert after[0] == after[1] != before[0]
    process(folder / "shots/a.usda")


def test_a_layer_that_is_there_stays_and_a_difference_is_said(folder: Path) -> None:
    shoot(folder, "a")
    kept = (folder / "anna.usda").read_bytes()
    (folder / "anna.json").write_text(json.dumps({"shapes": {"jawOpen": {"gain": 0.8}}}))
    assert "LAYER_KEPT" in shoot(folder, "b")
    assert (folder / "anna.usda").read_bytes() == kept
    assert content(folder / "shots/a.usda") == content(folder / "shots/b.usda")


def test_the_rule_base_that_a_shot_gets_in_place_of_its_own_is_reported(folder: Path) -> None:
    shoot(folder, "a")
    assert "LAYER_RULES_DIFFER" not in shoot(folder, "b", correction={"gain": 0.5})
    system, _ = read_fuzzy_file(folder / "shots/a.usda")
    fewer = replace(system, fuzzy=replace(system.fuzzy, rules=system.fuzzy.rules[:-1]))
    write_fuzzy_file(folder / "fewer.usda", fewer)
    layers = {"character_layer": folder / "sets/mia.usda"}
    files = (folder / n for n in ("rig.usda", "take.usda", "shots/c.usda"))
    result = make_shot(*files, bind=folder / "bind.json", fuzzy=folder / "fewer.usda", **layers)
    (found,) = [each for each in result.findings if each.code == "LAYER_RULES_DIFFER"]
    count = len(system.fuzzy.rules)
    assert found.where == str(folder / "shots/c.usda")
    assert found.values["kept_count"] == count and found.values["rule_count"] == count - 1
    assert found.values["name"] == str(folder / "fewer.usda")


def test_a_shot_without_rules_of_its_own_is_said_to_have_none(folder: Path) -> None:
    """A take of weights binds no marker, so no rules are designed for it."""
    shoot(folder, "a")
    names = make_world().rig.shape_names
    write_take(WeightsTake(names, [0.0, 0.1], np.zeros((2, len(names)))), folder / "phone.usda")
    files = (folder / n for n in ("rig.usda", "phone.usda", "shots/p.usda"))
    result = make_shot(*files, character_layer=folder / "sets/mia.usda")
    (found,) = [each for each in result.findings if each.code == "LAYER_RULES_DIFFER"]
    assert found.message.endswith("rules; it has none of its own")
    assert found.values["kept_count"] > 0 and "rule_count" not in found.values


def test_a_layer_of_another_character_is_refused(folder: Path) -> None:
    shoot(folder, "a")
    (folder / "rig.usda").rename(folder / "other.usda")
    files = (folder / n for n in ("other.usda", "take.usda", "shots/b.usda"))
    with pytest.raises(InputError, match="another character"):
        make_shot(*files, bind=folder / "bind.json", character_layer=folder / "sets/mia.usda")
    assert not (folder / "shots/b.usda").exists()


def test_a_rig_with_another_mesh_below_a_shot_is_refused(folder: Path) -> None:
    shoot(folder, "a")
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    mesh = stage.GetPrimAtPath("/Asset/Face/head")
    indices = list(mesh.GetAttribute("faceVertexIndices").Get())
    mesh.GetAttribute("faceVertexIndices").Set(indices[1:] + indices[:1])
    stage.Save()
    with pytest.raises(InputError, match="connect other points") as caught:
        process(folder / "shots/a.usda")
    assert caught.value.code == "BINDING_OTHER_MESH"
