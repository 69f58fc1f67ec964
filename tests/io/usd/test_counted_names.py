"""Names of blend shapes that an exporter counted through, as Blender's does over all meshes."""

from pathlib import Path

import numpy as np
import pytest
from processed import process, report
from pxr import Usd, UsdSkel
from sheets import sheet
from worlds import World, animation_of, make_world, write_live_link

import usdface
from usdface.io.usd.rig import read_rig, rig_of_stage


def count_through(path: Path, first: str) -> None:
    """Give each name that several meshes share a number, from the mesh that is called `first` on.

    The prims keep their names, as in Blender's USD.
    """
    stage = Usd.Stage.Open(str(path))
    meshes = [p for p in stage.Traverse() if UsdSkel.BindingAPI(p).GetBlendShapesAttr().Get()]
    seen: dict[str, int] = {}
    for prim in sorted(meshes, key=lambda prim: prim.GetName() != first):
        attribute = UsdSkel.BindingAPI(prim).GetBlendShapesAttr()
        names = list(attribute.Get())
        for i, name in enumerate(names):
            seen[name] = seen.get(name, 0) + 1
            names[i] = f"{name}{seen[name]}" if seen[name] > 1 else name
        attribute.Set(names)
    for prim in stage.Traverse():
        prim.RemoveProperty("skel:animationSource")
    stage.RemovePrim("/Asset/Face/Anim")
    stage.Save()


@pytest.fixture
def world(tmp_path: Path) -> World:
    made = make_world(teeth=True)
    made.write(tmp_path)
    return made


def test_a_rig_gets_its_own_names_back(world: World, tmp_path: Path) -> None:
    count_through(tmp_path / "rig.usda", "teeth")
    done = report(tmp_path, "rig", tmp_path / "rig.usda", "-o", tmp_path / "own.usda")
    (found,) = [each for each in done["findings"] if each["code"] == "NAME_CHANGED"]
    assert found["values"]["shapes"] == ["jawOpen2"]
    back, _ = read_rig(tmp_path / "own.usda")
    named = [(mesh.name, mesh.shape_names) for mesh in back.meshes]
    assert named == [(mesh.name, mesh.shape_names) for mesh in world.rig.meshes]


@pytest.mark.usefixtures("world")
def test_a_recording_moves_all_meshes_of_that_rig(tmp_path: Path) -> None:
    count_through(tmp_path / "rig.usda", "teeth")
    rig, _ = usdface.read_rig(tmp_path / "rig.usda")
    write_live_link(make_world(), tmp_path / "phone.csv")
    take, _ = usdface.read_take(tmp_path / "phone.csv")
    shot, _ = usdface.assemble_shot(rig, take)
    weights = usdface.retarget(shot).weights
    assert weights.weights[:, weights.names.index("jawOpen")].max() > 0.5
    assert "jawOpen2" not in weights.names


@pytest.mark.parametrize(("first", "lead", "own"), [("head", "", "2"), ("teeth", "2", "")])
@pytest.mark.usefixtures("world")
def test_a_shot_of_the_file_itself_moves_the_teeth_with_the_jaw(
    tmp_path: Path, first: str, lead: str, own: str
) -> None:
    count_through(tmp_path / "rig.usda", first)
    played = animation_of(process(tmp_path), muted="express.usdc")  # poses name what they know
    jaw = played.weights[:, played.names.index(f"jawOpen{lead}")]
    teeth = played.weights[:, played.names.index(f"jawOpen{own}")]
    np.testing.assert_allclose(teeth, jaw, atol=1e-6)
    assert teeth.max() > 0.5


@pytest.mark.usefixtures("world")
def test_a_shot_of_the_file_itself_reports_names_of_the_face(tmp_path: Path) -> None:
    count_through(tmp_path / "rig.usda", "teeth")
    paths = (tmp_path / name for name in ("rig.usda", "take.usda", "shot.usda"))
    findings = usdface.make_shot(*paths).findings
    (found,) = [each for each in findings if each.code == "SHAPE_NAMES_COUNTED"]
    assert (found.values["shapes"], found.values["names"]) == (["jawOpen2"], ["jawOpen"])


def test_a_number_alone_is_no_count() -> None:
    """The prim has another name, as a program may give it; no other mesh has the one before it."""
    rig, _ = rig_of_stage(sheet(names=("up2",)))
    assert rig.shape_names == ("up2",) and rig.meshes[0].shapes[0].label == "up"
    rig, _ = rig_of_stage(sheet(names=("lift",)))
    assert rig.meshes[0].shapes[0].label == ""
