from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import plays
from pxr import Usd, UsdSkel
from sheets import sheet

from usdface.errors import InputError
from usdface.io.usd.metrics import metrics_of, to_si
from usdface.io.usd.rig import read_rig, rig_of_stage
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.schemas import tokens
from usdface.takes import WeightsTake


def assert_same_shapes(found, expected, tolerance=1e-8):
    assert [s.name for s in found] == [s.name for s in expected]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.indices, other.indices)
        np.testing.assert_allclose(one.offsets, other.offsets, atol=tolerance)
        for a, b in zip(one.inbetweens, other.inbetweens, strict=True):
            assert (a.name, round(a.weight, 6)) == (b.name, b.weight)
            np.testing.assert_allclose(a.offsets, b.offsets, atol=tolerance)


def by_weight(mesh):
    """The mesh with each shape's inbetweens in the order of their weights."""
    return [
        replace(s, inbetweens=tuple(sorted(s.inbetweens, key=lambda b: b.weight)))
        for s in mesh.shapes
    ]


@pytest.mark.parametrize("which", ["face_rig", "skinned_rig"])
@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_what_is_written_is_read_back(which, suffix, request, tmp_path):
    rig = request.getfixturevalue(which)
    path = tmp_path / f"rig{suffix}"
    write_rig(rig, path)
    back, findings = read_rig(path)
    assert findings == []
    assert back.name == rig.name and [m.name for m in back.meshes] == [m.name for m in rig.meshes]
    for mesh, other in zip(rig.meshes, back.meshes, strict=True):
        np.testing.assert_allclose(other.points, mesh.points, atol=1e-8)
        np.testing.assert_array_equal(other.face_counts, mesh.face_counts)
        np.testing.assert_array_equal(other.face_indices, mesh.face_indices)
        if mesh.uvs is not None:
            np.testing.assert_allclose(other.uvs, mesh.uvs, atol=1e-7)
        assert_same_shapes(by_weight(other), by_weight(mesh))
        assert [(s.material, list(s.faces)) for s in other.subsets] == [
            (s.material, list(s.faces)) for s in mesh.subsets
        ]
    assert (back.skeleton is None) == (rig.skeleton is None)
    if rig.skeleton:
        assert (back.skeleton.joints, back.skeleton.names) == (
            rig.skeleton.joints,
            rig.skeleton.names,
        )
        np.testing.assert_allclose(back.skeleton.bind, rig.skeleton.bind, atol=1e-12)
        np.testing.assert_allclose(back.skeleton.rest, rig.skeleton.rest, atol=1e-12)
        np.testing.assert_array_equal(back.meshes[0].skin.joints, rig.meshes[0].skin.joints)
        np.testing.assert_allclose(
            back.meshes[0].skin.weights, rig.meshes[0].skin.weights, atol=1e-7
        )


def test_writing_what_was_read_changes_no_byte(face_rig, skinned_rig, tmp_path):
    for rig in (face_rig, skinned_rig):
        write_rig(rig, tmp_path / "one.usda")
        write_rig(read_rig(tmp_path / "one.usda")[0], tmp_path / "two.usda")
        write_rig(read_rig(tmp_path / "two.usda")[0], tmp_path / "three.usda")
        second, third = ((tmp_path / f"{n}.usda").read_text() for n in ("two", "three"))
        assert second == third


@pytest.mark.parametrize("keep", [0.0, 0.1, 0.5, 0.9])
def test_a_cut_off_file_is_one_clear_line(face_rig, tmp_path, keep):
    write_rig(face_rig, tmp_path / "rig.usdc")
    data = (tmp_path / "rig.usdc").read_bytes()
    cut = tmp_path / "cut.usdc"
    cut.write_bytes(data[: int(len(data) * keep)])
    with pytest.raises(InputError, match=r"cut\.usdc") as caught:
        read_rig(cut)
    assert "\n" not in str(caught.value)


def test_a_point_that_is_no_number_is_one_clear_line(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "rig.usda")
    text = (tmp_path / "rig.usda").read_text()
    wrong = text.replace("point3f[] points = [(-0.1, -0.1", "point3f[] points = [(-0.1, nan", 1)
    assert wrong != text
    (tmp_path / "rig.usda").write_text(wrong)
    with pytest.raises(InputError, match="finite") as caught:
        read_rig(tmp_path / "rig.usda")
    assert "\n" not in str(caught.value) and "rig.usda" in str(caught.value)


REAL = (
    "openusd_usdskel/bakeSkinning/blendshapes.usda",
    "openusd_usdskel/bakeSkinning/blendshapesWithNormals.usda",
    "openusd_usdskel/imagingGL/blendshapes.usda",
    "tinyusdz_blendshape/blendshape-and-animation-test-001.usda",
    "tinyusdz_blendshape/blendshape.usda",
    "tinyusdz_blendshape/blendshape.usdc",
    "tinyusdz_blendshape/simple-blendshape-test-001.usda",
    "mayausd_morpher/morpher_box.usd",
)


@pytest.mark.parametrize("name", REAL)
def test_read_shapes_move_as_usdskel_moves_them(name, shared_data, posed, baked, tmp_path):
    path = shared_data / name
    stage = open_stage(path)
    rig, _ = rig_of_stage(stage)
    anims = [UsdSkel.Animation(p) for p in stage.Traverse() if p.IsA(UsdSkel.Animation)]
    tokens = tuple(anims[0].GetBlendShapesAttr().Get()) if anims else ()
    weights = anims[0].GetBlendShapeWeightsAttr() if anims else None
    samples = (weights.GetTimeSamples() if weights else []) or [0.0]
    samples = [t for t in samples if weights is None or len(weights.Get(t)) == len(tokens)]
    world = baked(path, samples)
    si = to_si(metrics_of(stage))[:3, :3]
    for mesh in (mesh for mesh in rig.meshes if mesh.path in world):
        expected = world[mesh.path] @ si
        for code, points in zip(samples, expected, strict=True):
            row = dict(zip(tokens, weights.Get(code), strict=True)) if weights else {}
            found = posed(mesh, np.array([row.get(n, 0.0) for n in mesh.shape_names]))
            np.testing.assert_allclose(found, points, atol=3e-6 * max(1, np.abs(points).max()))


@pytest.mark.parametrize("name", REAL)
def test_a_real_rig_rewritten_is_valid_and_moves_alike(
    name, shared_data, posed, baked, tmp_path, assert_valid_usd
):
    rig, _ = read_rig(shared_data / name)
    rng = np.random.default_rng(1)
    weights = rng.uniform(-1, 2, (3, len(rig.shape_names)))
    path = tmp_path / "again.usdc"
    write_rig(rig, path, plays(WeightsTake(rig.shape_names, [0, 1, 2], weights, 1.0)))
    assert_valid_usd(path)
    for mesh, points in zip(rig.meshes, baked(path, [0, 1, 2]).values(), strict=True):
        size = max(1, np.abs(points).max())
        for row, found in zip(weights, points, strict=True):
            own = row if mesh.shapes else row[:0]
            np.testing.assert_allclose(found, posed(mesh, own), atol=3e-6 * size)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("openusd_usdskel/misc/badSkelBindingNoSkelRoot.usda", "no SkelRoot"),
        ("openusd_usdskel/misc/cleanSkelBindingAPIApplied.usda", "no mesh"),
        ("tinyusdz_blendshape/inbetween-blendshape-001.usda", "no SkelRoot"),
        ("tinyusdz_blendshape/inbetween-blendshape-002.usda", "cannot be read as USD"),
    ],
)
def test_what_is_no_rig_is_refused_in_one_line(name, message, shared_data):
    with pytest.raises(InputError, match=message) as caught:
        read_rig(shared_data / name)
    assert "\n" not in str(caught.value) and Path(name).name in str(caught.value)


def marker_take() -> Usd.Stage:
    """A stage of markers alone, as from a rig and a take that were swapped."""
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/Take", tokens.MARKER_TAKE)
    return stage


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sheet(targets=("up", "more")), "1 skel:blendShapes names for 2"),
        (lambda: Usd.Stage.CreateInMemory(), "no SkelRoot.*export the character as UsdSkel"),
        (marker_take, "it holds a marker take; expected a character"),
    ],
)
def test_what_makes_no_sense_is_an_input_error(make, message):
    with pytest.raises(InputError, match=message):
        rig_of_stage(make())


def test_only_meshes_below_the_named_prim_are_read(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "rig.usda")
    stage = open_stage(tmp_path / "rig.usda")
    assert len(rig_of_stage(stage, "/Asset/Face")[0].meshes) == 2
    assert [m.name for m in rig_of_stage(stage, "/Asset/Face/Head")[0].meshes] == ["Head"]
    for wrong in ("/Nowhere", "not a path", "/Asset/Materials"):
        with pytest.raises(InputError, match=r"no prim|no SkelRoot"):
            rig_of_stage(stage, wrong)


@pytest.mark.slow
def test_a_real_face_comes_back(shared_data, tmp_path):
    packed = np.load(shared_data / "ict_facekit" / "ict_expressions.npz")
    names = [str(name) for name in packed["shapes"]][:53]
    shapes = tuple(BlendShape(n, packed[f"idx_{n}"], 0.01 * packed[f"off_{n}"]) for n in names)
    faces = packed["faceVertexCounts"], packed["faceVertexIndices"]
    mesh = Mesh("Head", 0.01 * packed["points"], *faces, shapes=shapes)
    write_rig(Rig("ict", (mesh,)), tmp_path / "ict.usdc")
    rig, findings = read_rig(tmp_path / "ict.usdc")
    assert findings == []
    assert_same_shapes(rig.meshes[0].shapes, shapes, 1e-7)
