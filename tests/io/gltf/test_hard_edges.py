"""Flat faces and hard edges look the same on both sides."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from clips import evaluate_gltf
from pxr import Gf, Usd, UsdGeom, Vt
from sheets import sheet

from usdface.io.gltf.hard_edges import split_hard_edges
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.rig import read_rig
from usdface.pipeline import export_scene, import_scene, make_rig
from usdface.rigs import CORNER_NORMALS, BlendShape, CornerValues, Inbetween, Mesh, Rig

UP, SIDE = (0, 0, 1), (1, 0, 0)
SQUARES = [0, 1, 2, 3, 1, 4, 5, 2]  # two, which share the edge from 1 to 2
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, -1], [1, 1, -1.0]])


def roof() -> Mesh:
    half = Inbetween("half", 0.5, [[0, 0, 0.3]] * 2)
    lift = BlendShape("lift", [1, 2], [[0, 0, 0.5]] * 2, inbetweens=(half,))
    normals = CornerValues(CORNER_NORMALS, np.array([UP] * 4 + [SIDE] * 4, float))
    return Mesh("roof", POINTS, [4, 4], SQUARES, shapes=(lift,), corner_values=(normals,))


def test_a_point_on_an_edge_becomes_two_that_move_alike() -> None:
    split = split_hard_edges(roof())
    assert split.points.shape == (8, 3) and split.corners(CORNER_NORMALS) is None
    np.testing.assert_allclose(split.points[split.face_indices], POINTS[SQUARES])
    np.testing.assert_allclose(split.normals[split.face_indices], [UP] * 4 + [SIDE] * 4)
    moved = split.offsets_at(split.face_indices)[0]
    np.testing.assert_allclose(moved, roof().offsets_at(np.array(SQUARES))[0])
    assert split.shapes[0].inbetweens[0].offsets.shape == (4, 3)
    plain = replace(roof(), corner_values=())
    assert split_hard_edges(plain) is plain


def test_hard_edges_of_a_stage_stay_hard(tmp_path: Path) -> None:
    stage = sheet(offsets=((0, 0, 0.5),) * 2, indices=(1, 2))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(POINTS.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr(SQUARES)
    mesh.CreateNormalsAttr([Gf.Vec3f(*UP)] * 4 + [Gf.Vec3f(*SIDE)] * 4)
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    stage.Export(str(tmp_path / "a.usda"))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True)
    assert [f.code for f in done.findings if f.severity != "info"] == []
    (shown,) = evaluate_gltf(tmp_path / "a.glb")
    assert len(shown.points) == 8
    assert {tuple(n) for n in np.round(shown.normals, 6).tolist()} == {UP, SIDE}
    make_rig(tmp_path / "a.usda", tmp_path / "rig.usda")  # face by face, as it was
    again = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    made = UsdGeom.Mesh(again.GetPrimAtPath("/Asset/Face/M"))
    assert made.GetNormalsInterpolation() == UsdGeom.Tokens.faceVarying
    assert read_rig(tmp_path / "rig.usda")[0].meshes[0].corners(CORNER_NORMALS) is not None


def test_a_file_without_normals_is_flat_in_both(tmp_path: Path, write_glb) -> None:
    points = POINTS.astype("<f4")
    corners = np.array([0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2], "<u2")
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "targets": [{"POSITION": 2}]}
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["up"]}}],
    }
    path = write_glb(tmp_path / "a.glb", document, [points, corners, 0.1 * points])
    done = import_scene(path, tmp_path / "a.usda")
    assert {f.code for f in done.findings} == {"NORMALS_FLAT"}
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    (mesh,) = (UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert not mesh.GetNormalsAttr().HasAuthoredValue()
    assert len(mesh.GetPointsAttr().Get()) == 6  # none is split: the program makes the normals
    export_scene(tmp_path / "a.usda", tmp_path / "b.glb")
    rig: Rig = read_gltf(tmp_path / "b.glb")[0]
    assert rig.meshes[0].flat and evaluate_gltf(tmp_path / "b.glb")[0].normals is None
