from dataclasses import replace

import numpy as np
import pygltflib
import pytest

from usdface.errors import OutputError
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.write_mesh import write_mesh
from usdface.rigs import BlendShape, MaterialSubset, Mesh, Rig, Skin


def counts_of(mesh: Mesh, joints: int = 0) -> tuple[int, BufferBuilder, pygltflib.Mesh]:
    builder = BufferBuilder()
    made, _ = write_mesh(mesh, {}, builder, joints)
    assert made is not None
    return builder.accessors[made.primitives[0].attributes.POSITION].count, builder, made


def numbers(builder: BufferBuilder, index: int) -> np.ndarray:
    """A dense float32 or unsigned accessor, read back by hand."""
    accessor = builder.accessors[index]
    dtype = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor.componentType]
    start = builder.views[accessor.bufferView].byteOffset
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor.type]
    flat = np.frombuffer(b"".join(builder.blob), dtype, accessor.count * width, start)
    return flat.reshape(-1, width)


def test_vertices_split_only_at_texture_seams(face_rig: Rig) -> None:
    mesh = face_rig.meshes[0]
    assert counts_of(mesh)[0] == len(mesh.points)
    assert counts_of(replace(mesh, uvs=None))[0] == len(mesh.points)
    corner = np.zeros((len(mesh.face_indices), 2))
    corner[2] = 0.5  # one corner at an inner point is torn off
    torn = replace(mesh, uvs=mesh.uvs + corner)
    assert counts_of(torn)[0] == len(mesh.points) + 1
    alone = replace(mesh, uvs=np.arange(2.0 * len(mesh.face_indices)).reshape(-1, 2))
    assert counts_of(alone)[0] == len(mesh.face_indices)


def test_points_without_a_face_are_left_out() -> None:
    mesh = Mesh("m", np.arange(15.0).reshape(5, 3) ** 2, [3], [4, 0, 2])
    count, builder, made = counts_of(mesh)
    assert count == 3
    np.testing.assert_array_equal(
        numbers(builder, made.primitives[0].attributes.POSITION), mesh.points[[0, 2, 4]]
    )
    np.testing.assert_array_equal(numbers(builder, made.primitives[0].indices).T, [[2, 0, 1]])


def test_what_shows_nothing_is_announced() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5], [6, 6, 6]]
    mesh = Mesh("m", points, [3, 2], [0, 1, 2, 2, 3], flat=True)
    _, found = write_mesh(mesh, {}, BufferBuilder(), 0)
    assert [f.values.get("channels") for f in found] == [
        ["1 faces of fewer than three corners", "2 points of no face"]
    ]


def test_v_is_flipped() -> None:
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], uvs=[[0, 0], [1, 0.25], [0, 1]])
    _, builder, made = counts_of(mesh)
    uvs = numbers(builder, made.primitives[0].attributes.TEXCOORD_0)
    np.testing.assert_array_equal(uvs, [[0, 1], [1, 0.75], [0, 0]])


def test_a_primitive_for_each_material_and_one_for_the_rest(face_rig: Rig) -> None:
    pbr = pygltflib.PbrMetallicRoughness()
    names = {
        name: pygltflib.Material(name=name, pbrMetallicRoughness=pbr) for name in ("skin", "lips")
    }
    mesh = replace(
        face_rig.meshes[0],
        subsets=(
            MaterialSubset("lips", np.arange(3)),
            MaterialSubset("skin", np.arange(2, 9)),  # face 2 stays with the first
            MaterialSubset("skin", np.array([], int)),
        ),
    )
    builder = BufferBuilder()
    made, _ = write_mesh(mesh, names, builder, 0)
    assert made is not None
    assert [p.material for p in made.primitives] == [1, 0, None]
    sizes = [builder.accessors[p.indices].count // 6 for p in made.primitives]
    assert sizes == [3, 6, 16]
    assert all(p.targets == made.primitives[0].targets for p in made.primitives)
    between = sum(len(shape.inbetweens) for shape in mesh.shapes)
    assert len(made.primitives[0].targets) == len(made.weights) == len(mesh.shapes) + between


def test_a_subset_must_fit_its_mesh(face_rig: Rig) -> None:
    mesh = replace(face_rig.meshes[0], subsets=(MaterialSubset("skin", np.array([25])),))
    with pytest.raises(OutputError, match="subset 'skin'"):
        write_mesh(mesh, {}, BufferBuilder(), 0)


def test_an_unknown_material_is_announced(face_rig: Rig) -> None:
    _, found = write_mesh(face_rig.meshes[0], {}, BufferBuilder(), 0)
    assert [f.code for f in found] == [
        "FACES_TRIANGULATED",
        "NORMALS_COMPUTED",
        "FEATURE_DROPPED",
        "FEATURE_DROPPED",
    ]


def test_normals_of_a_shape_that_turns_the_mesh() -> None:
    # A triangle in the x-y plane, which the shape turns about x by a quarter.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    shape = BlendShape("turn", [2], [[0, -1, 1]])
    _, builder, made = counts_of(Mesh("m", points, [3], [0, 1, 2], shapes=(shape,)))
    normal = numbers(builder, made.primitives[0].attributes.NORMAL)
    np.testing.assert_allclose(normal, np.tile([0, 0, 1], (3, 1)), atol=1e-7)
    change = numbers(builder, made.primitives[0].targets[0]["NORMAL"])
    np.testing.assert_allclose(normal + change, np.tile([0, -1, 0], (3, 1)), atol=1e-7)


def test_authored_normals_and_their_offsets_are_kept() -> None:
    normals = np.array([[0, 0, 1.0], [0, 1, 0], [0.6, 0, 0.8]])
    shape = BlendShape("s", [0, 1, 2], np.ones((3, 3)), [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]])
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], normals, shapes=(shape,))
    _, builder, made = counts_of(mesh)
    primitive = made.primitives[0]
    np.testing.assert_allclose(numbers(builder, primitive.attributes.NORMAL), normals, atol=1e-7)
    change = numbers(builder, primitive.targets[0]["NORMAL"])
    np.testing.assert_allclose(change, shape.normal_offsets, atol=1e-7)


def skinned(joints: np.ndarray, weights: np.ndarray) -> Mesh:
    return Mesh("m", np.eye(3), [3], [0, 1, 2], skin=Skin(joints, weights))


def test_more_than_four_joints_are_sets_of_four_the_strongest_first() -> None:
    joints = np.array([[0, 1, 2, 3, 4, 5]] * 3)
    weights = np.array([[0.3, 0.05, 0.2, 0.1, 0.25, 0.1], [1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]])
    builder = BufferBuilder()
    made, found = write_mesh(skinned(joints, weights), {}, builder, 6)
    assert made is not None
    held = vars(made.primitives[0].attributes)
    kept = np.concatenate([numbers(builder, held[f"JOINTS_{k}"]) for k in (0, 1)], 1)
    share = np.concatenate([numbers(builder, held[f"WEIGHTS_{k}"]) for k in (0, 1)], 1)
    np.testing.assert_array_equal(kept[0], [0, 4, 2, 3, 5, 1, 0, 0])
    np.testing.assert_array_equal(kept[1:], 0)
    np.testing.assert_allclose(share[0], [0.3, 0.25, 0.2, 0.1, 0.1, 0.05, 0, 0], atol=1e-7)
    np.testing.assert_array_equal(share[1:], [[1] + [0] * 7] * 2)
    assert [f.code for f in found] == ["NORMALS_COMPUTED", "FEATURE_APPROXIMATED"]


def test_joints_named_twice_are_added_up() -> None:
    joints, weights = np.array([[7, 2, 7]] * 3), np.array([[0.25, 0.375, 0.375]] * 3)
    _, builder, made = counts_of(skinned(joints, weights), 300)
    kept = numbers(builder, made.primitives[0].attributes.JOINTS_0)
    assert kept.dtype == np.uint16
    np.testing.assert_array_equal(kept[0], [7, 2, 0, 0])
    share = numbers(builder, made.primitives[0].attributes.WEIGHTS_0)
    np.testing.assert_array_equal(share[0], [0.625, 0.375, 0, 0])


def test_weights_sum_to_one_in_float32() -> None:
    rng = np.random.default_rng(5)
    count = 500
    mesh = Mesh(
        "m",
        rng.normal(size=(count, 3)),
        np.full(count, 3),
        np.arange(3 * count) % count,
        skin=Skin(np.tile(np.arange(8), (count, 1)), rng.random((count, 8)) ** 4),
    )
    _, builder, made = counts_of(mesh, 8)
    held = vars(made.primitives[0].attributes)
    share = np.concatenate([numbers(builder, held[f"WEIGHTS_{k}"]) for k in (0, 1)], 1)
    assert np.abs(share.astype(float).sum(axis=1) - 1).max() < 2e-7


@pytest.mark.parametrize("joint", [-1, 6])
def test_a_skin_must_fit_the_skeleton(joint: int) -> None:
    with pytest.raises(OutputError, match="joint outside"):
        counts_of(skinned(np.full((3, 1), joint), np.ones((3, 1))), 6)


def test_textures_always_get_coordinates() -> None:
    info = pygltflib.TextureInfo(index=0)
    pbr = pygltflib.PbrMetallicRoughness(baseColorTexture=info)
    materials = {"m": pygltflib.Material(name="m", pbrMetallicRoughness=pbr)}
    builder = BufferBuilder()
    made, _ = write_mesh(Mesh("m", np.eye(3), [3], [0, 1, 2], material="m"), materials, builder, 0)
    assert made is not None
    assert builder.accessors[made.primitives[0].attributes.TEXCOORD_0].count == 3


def test_a_mesh_without_faces_is_left_out() -> None:
    made, found = write_mesh(Mesh("m", np.eye(3), [], []), {}, BufferBuilder(), 0)
    assert made is None
    assert [f.code for f in found] == ["FEATURE_DROPPED"]
