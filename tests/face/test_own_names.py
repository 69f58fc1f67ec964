"""Names of blend shapes that were made unique over the meshes of a face."""

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from processed import process, report
from pxr import Usd, UsdSkel
from sheets import sheet
from worlds import World, animation_of, make_world, write_live_link

import usdface
from usdface.clips import Clip
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.rigs.scene_rig import read_gltf_rig
from usdface.io.usd.rig import read_rig, rig_of_stage
from usdface.options import RigOptions
from usdface.takes import WeightsTake


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


def test_a_rig_of_a_gltf_has_the_names_that_its_animations_tell_apart(tmp_path: Path) -> None:
    """As Blender writes a clip for each action: one of the head, one of the teeth."""
    rig = make_world(teeth=True).rig
    times = np.array([0.0, 1.0])
    clips = []
    for mesh in rig.meshes:
        column = mesh.shape_names.index("jawOpen")
        weights = np.zeros((2, len(mesh.shape_names)))
        weights[1, column] = 1.0
        names = tuple(f"{mesh.name}:{name}" for name in mesh.shape_names)
        clips.append(Clip(mesh.name, WeightsTake(names, times, weights)))
    apart = (
        replace(s, name=f"{m.name}:{s.name}", label=s.name) for m in rig.meshes for s in m.shapes
    )
    meshes = (replace(m, shapes=tuple(islice(apart, len(m.shapes)))) for m in rig.meshes)
    write_gltf(replace(rig, meshes=tuple(meshes)), tmp_path / "face.glb", tuple(clips))
    _unnamed(tmp_path / "face.glb")
    played, _, found = read_gltf(tmp_path / "face.glb")
    assert "teeth:jawOpen" in played.shape_names
    assert "NAME_CHANGED" in {each.code for each in found}
    still, found = read_gltf_rig(tmp_path / "face.glb", RigOptions())
    assert [m.shape_names for m in still.meshes] == [m.shape_names for m in rig.meshes]
    assert "NAME_CHANGED" not in {each.code for each in found}


def _unnamed(path: Path) -> None:
    """Take the names out that only our own files have."""
    document = pygltflib.GLTF2().load(str(path))
    for mesh in document.meshes:
        mesh.extras.pop("usdface", None)
    document.save(str(path))


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
    stage = sheet(names=("up2", "up"), targets=("up", "other"))
    UsdSkel.BlendShape.Define(stage, "/R/M/other").CreateOffsetsAttr([(0, 0, 1)] * 3)
    assert [s.label for s in rig_of_stage(stage)[0].meshes[0].shapes] == ["", ""]
    rig, _ = rig_of_stage(sheet(names=("lift",)))
    assert rig.meshes[0].shapes[0].label == ""
