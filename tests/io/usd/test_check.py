from dataclasses import replace

import numpy as np
import pytest
from clips import plays
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt
from worlds import make_world

from usdface.errors import InputError
from usdface.io.usd.check import check_stage, check_usd
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import Inbetween
from usdface.takes import WeightsTake

NAN = float("nan")


def stage_with(
    offsets=((0, 1, 0),),
    indices=(1,),
    names=("up",),
    targets=("/R/M/up",),
    between=None,
    weights=None,
    bound="/R/Anim",
):
    stage = Usd.Stage.CreateInMemory()
    UsdSkel.Root.Define(stage, "/R")
    mesh = UsdGeom.Mesh.Define(stage, "/R/M")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 2, 3)])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateBlendShapesAttr(names)
    binding.CreateBlendShapeTargetsRel().SetTargets([Sdf.Path(target) for target in targets])
    binding.CreateAnimationSourceRel().SetTargets([bound])
    binding.CreateSkeletonRel().SetTargets([UsdSkel.Skeleton.Define(stage, "/R/Skel").GetPath()])
    shape = UsdSkel.BlendShape.Define(stage, "/R/M/up")
    shape.CreateOffsetsAttr([Gf.Vec3f(*o) for o in offsets])
    if indices is not None:
        shape.CreatePointIndicesAttr(Vt.IntArray(indices))
    for number, (weight, moved) in enumerate(between or ()):
        made = shape.CreateInbetween(f"b{number}")
        made.SetOffsets(moved)
        if weight is not None:
            made.SetWeight(weight)
    anim = UsdSkel.Animation.Define(stage, "/R/Anim")
    anim.CreateBlendShapesAttr(["up"])
    for code, row in (weights or {}).items():
        anim.CreateBlendShapeWeightsAttr().Set(row, code)
    return stage


UP = [(0, 1, 0)]
BROKEN = {
    "outside": ({"indices": (3,)}, "POINT_INDICES_OUTSIDE"),
    "negative": ({"indices": (-1,)}, "POINT_INDICES_OUTSIDE"),
    "unsorted": ({"indices": (2, 1), "offsets": UP * 2}, "POINT_INDICES_UNSORTED"),
    "repeated": ({"indices": (1, 1), "offsets": UP * 2}, "POINT_INDICES_REPEATED"),
    "short": ({"indices": (1, 2)}, "OFFSETS_LENGTH_WRONG"),
    "dense": ({"indices": None}, "OFFSETS_LENGTH_WRONG"),
    "names": ({"names": ("up", "down")}, "SHAPE_NAMES_MISMATCH"),
    "twice": ({"names": ("up", "up"), "targets": ("/R/M/up", "/R/M")}, "SHAPE_NAME_REPEATED"),
    "dangling": ({"targets": ("/R/M/gone",)}, "SHAPE_TARGET_MISSING"),
    "other prim": ({"targets": ("/R/M",)}, "SHAPE_TARGET_MISSING"),
    "unbound": ({"bound": "/R/Nothing"}, "BINDING_TARGET_MISSING"),
    "at 0": ({"between": [(0.0, UP)]}, "INBETWEEN_WRONG"),
    "at 1": ({"between": [(1.0, UP)]}, "INBETWEEN_WRONG"),
    "twice at 0.5": ({"between": [(0.5, UP), (0.5, UP)]}, "INBETWEEN_WRONG"),
    "nowhere": ({"between": [(None, UP)]}, "INBETWEEN_WRONG"),
    "between short": ({"between": [(0.5, UP * 2)]}, "OFFSETS_LENGTH_WRONG"),
    "nan": ({"offsets": [(0, NAN, 0)]}, "VALUES_WRONG"),
    "between nan": ({"between": [(0.5, [(0, NAN, 0)])]}, "VALUES_WRONG"),
    "empty": ({"offsets": [(0, 0, 0)]}, "SHAPE_EMPTY"),
    "long weights": ({"weights": {1: [0], 2: [0, 0]}}, "WEIGHTS_LENGTH_WRONG"),
    "no weights": ({"weights": {1: [0], 2: []}}, "WEIGHTS_LENGTH_WRONG"),
    "nan weights": ({"weights": {1: [0], 2: [NAN]}}, "VALUES_WRONG"),
    "above 1": ({"weights": {1: [0], 2: [1.01]}}, "WEIGHTS_OUT_OF_RANGE"),
    "below 0": ({"weights": {1: [-0.01]}}, "WEIGHTS_OUT_OF_RANGE"),
}


FACES = {
    "corners": {"counts": [3, 3], "corners": [0, 1, 2]},
    "beyond": {"counts": [3], "corners": [0, 1, 3]},
    "negative": {"counts": [3], "corners": [0, -1, 2]},
}


@pytest.mark.parametrize("name", FACES)
def test_faces_that_do_not_fit_the_points_are_found(name):
    stage = stage_with()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    mesh.CreateFaceVertexCountsAttr(FACES[name]["counts"])
    mesh.CreateFaceVertexIndicesAttr(FACES[name]["corners"])
    assert [f.code for f in check_stage(stage)] == ["TOPOLOGY_DIFFERS"]


def test_points_whose_number_changes_are_found():
    stage = stage_with()
    points = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).GetPointsAttr()
    points.Set([(0, 0, 0), (1, 0, 0), (0, 2, 3)], 1)
    points.Set([(0, 0, 0), (1, 0, 0)], 2)
    (found,) = check_stage(stage)
    assert found.code == "TOPOLOGY_DIFFERS"
    assert found.message == "points change in number over time, 2 to 3"


def test_a_polygonal_face_needs_normals_that_follow_its_shapes():
    stage = stage_with()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    assert check_stage(stage) == []  # subdivision makes its own
    mesh.CreateSubdivisionSchemeAttr("none")
    (found,) = check_stage(stage)
    assert (found.code, found.where) == ("NORMALS_MISSING", "/R/M")
    mesh.CreateNormalsAttr([(0, 0, 1)] * 3)
    (found,) = check_stage(stage)
    assert found.message == "no normalOffsets: up"
    UsdSkel.BlendShape(stage.GetPrimAtPath("/R/M/up")).CreateNormalOffsetsAttr([(0, 1, 0)])
    assert check_stage(stage) == []


@pytest.mark.parametrize("name", BROKEN)
def test_each_fault_is_found(name):
    changes, code = BROKEN[name]
    assert code in [f.code for f in check_stage(stage_with(**changes))]


def test_a_sound_stage_has_no_findings():
    sound = stage_with(between=[(0.5, UP), (-0.5, UP), (1.5, UP)], weights={1: [0], 2: [1]})
    assert check_stage(sound) == []


@pytest.mark.parametrize("name", sorted(set(BROKEN) - {"twice", "names"}))
def test_one_fault_is_one_finding(name):
    assert len(check_stage(stage_with(**BROKEN[name][0]))) == 1


def test_a_finding_says_where_and_when():
    found = check_stage(stage_with(weights={1: [0, 0], 2: [0], 7: []}))
    assert [(f.where, f.message) for f in found] == [
        ("/R/Anim", "2 weights for 1 blendShapes at time code 1 and at 1 more")
    ]


def test_what_we_write_is_sound(face_rig, skinned_rig, tmp_path):
    for rig in (face_rig, skinned_rig):
        weights = np.linspace(0, 1, 3 * len(rig.shape_names)).reshape(3, -1)
        path = tmp_path / "rig.usda"
        write_rig(rig, path, plays(WeightsTake(rig.shape_names, [0, 1, 2], weights, 1.0)))
        assert check_usd(path) == []


def test_real_exports_have_the_faults_they_are_known_for(shared_data):
    found = check_usd(shared_data / "mayausd_morpher" / "morpher_box.usd")
    assert [f.code for f in found] == [
        "NORMALS_MISSING",
        "POINT_INDICES_UNSORTED",
        "WEIGHTS_LENGTH_WRONG",
        "WEIGHTS_OUT_OF_RANGE",
    ]
    normals_only = "openusd_usdskel/bakeSkinning/blendshapesWithNormals.usda"
    assert check_usd(shared_data / normals_only) == []
    with pytest.raises(InputError, match="cannot be read"):
        check_usd(shared_data / "tinyusdz_blendshape" / "inbetween-blendshape-002.usda")


def test_a_point_that_lies_or_is_moved_far_off_is_found(tmp_path):
    """In metres or centimetres, as one of the mesh, of a shape, of an inbetween."""
    rig = make_world().rig
    (mesh,) = rig.meshes
    opened = mesh.shapes[0]
    assert check_written(rig, tmp_path / "sound.usda") == []
    points = mesh.points.copy()
    points[40, 0] = 30.0
    dragged = opened.offsets.copy()
    dragged[3] += 0.55
    between = replace(opened, inbetweens=(Inbetween("half", 0.5, dragged),))
    shapes = {"mesh": mesh.shapes, "offsets": replace(opened, offsets=dragged), "between": between}
    for name, spoilt in shapes.items():
        if name == "mesh":
            wrong, where = replace(mesh, points=points), "/head"
        else:
            wrong, where = replace(mesh, shapes=(spoilt, *mesh.shapes[1:])), f"/{opened.name}"
        (found,) = check_written(replace(rig, meshes=(wrong,)), tmp_path / f"{name}.usda")
        assert found.code == "POINT_STRAY" and found.where.endswith(where)
        number = 40 if name == "mesh" else opened.indices[3]
        assert f"point {number} " in found.message


def check_written(rig, path):
    write_rig(rig, path)
    return [found for found in check_usd(path) if found.code != "NORMALS_MISSING"]
