from dataclasses import replace

import numpy as np
from curved_world import make_curved_world
from worlds import make_world

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.geometry.triangulation import triangle_fans
from usdface.materials import Material, Placement, Texture
from usdface.page.character import character_data, page_meshes
from usdface.rigs import BlendShape, MaterialSubset, Mesh, Rig, Skeleton, Skin


def test_triangles_are_grouped_by_material() -> None:
    points = np.random.default_rng(0).normal(size=(6, 3))
    subsets = (MaterialSubset("red", [1]), MaterialSubset("gone", [2]))
    mesh = Mesh("m", points, [3, 4, 3], [0, 1, 2, 1, 2, 3, 4, 3, 4, 5], subsets=subsets)
    rig = Rig("r", (mesh,), materials=(Material("red", (1.0, 0.0, 0.0)), Material("unused")))
    data = character_data(rig, rig.meshes)
    assert [material["name"] for material in data["materials"]] == ["", "red"]
    assert data["meshes"][0]["groups"] == [
        {"start": 0, "count": 6, "material": 0},
        {"start": 6, "count": 6, "material": 1},
    ]
    assert data["meshes"][0]["triangles"].tolist()[2:] == [[1, 2, 3], [1, 3, 4]]


def test_targets_add_up_to_what_the_evaluator_says() -> None:
    world = make_curved_world()
    rig, mesh = world.rig, world.rig.meshes[0]
    data = character_data(rig, rig.meshes)
    every = np.arange(len(mesh.points))
    evaluator, _ = evaluator_of(mesh.shapes, every)
    for shape in data["meshes"][0]["shapes"]:
        for weight, target in zip(shape["weights"], shape["offsets"], strict=True):
            weights = np.zeros((1, len(mesh.shapes)))
            weights[0, shape["shape"]] = weight
            expected = evaluator.displacements(weights)[0].reshape(-1, 3)
            moved = np.zeros_like(expected)
            moved[shape["vertices"]] = target.values
            np.testing.assert_allclose(moved, expected, atol=1e-12)
            assert shape["weights"] == sorted(shape["weights"]) and 1.0 in shape["weights"]
    assert len(data["meshes"][0]["shapes"]) == len(mesh.shapes)
    names = data["shapes"]
    found = {
        names[c["shape"]]: ([names[p] for p in c["of"]], c["least"]) for c in data["combinations"]
    }
    assert found["browsWorried"] == (["browDownLeft", "browInnerUp"], True)
    assert found["smileOpenLeft"] == (["jawOpen", "mouthSmileLeft"], False)


def test_a_mesh_that_nothing_moves_is_left_out_on_request() -> None:
    rig = make_world(teeth=True).rig
    still = Mesh("hair", np.eye(3), [3], [0, 1, 2])
    rig = replace(rig, meshes=(still, *rig.meshes))
    assert [mesh.name for mesh in page_meshes(rig, True)] == [m.name for m in rig.meshes[1:]]
    assert page_meshes(rig, False) == rig.meshes
    lone = replace(rig, meshes=(still,))
    assert page_meshes(lone, True) == (still,)


def test_the_strongest_four_joints_move_a_point() -> None:
    weights = np.array([[0.1, 0.3, 0.05, 0.25, 0.3]] * 3)
    joints = np.tile(np.arange(5), (3, 1))
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], skin=Skin(joints, weights))
    paths = ("a", "a/b", "a/b/c", "a/d", "a/d/e")
    skeleton = Skeleton(paths, paths, np.tile(np.eye(4), (5, 1, 1)), np.tile(np.eye(4), (5, 1, 1)))
    data = character_data(Rig("r", (mesh,), skeleton), (mesh,))
    assert data["joints"]["parents"] == [-1, 0, 1, 0, 3]
    skin = data["meshes"][0]["skin"]
    assert skin["joints"][0].tolist() == [1, 4, 3, 0]
    np.testing.assert_allclose(skin["weights"].values[0], np.array([0.3, 0.3, 0.25, 0.1]) / 0.95)


def textured_rig(image: bytes = b"") -> Rig:
    """Two quads side by side; the texture's seam runs between them."""
    points = np.array([[x, y, 0.0] for y in (0, 1) for x in (0, 1, 2)])
    corners = [0, 1, 4, 3, 1, 2, 5, 4]
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [1, 0], [1, 1], [0, 1]]
    placed = Placement(scale=(0.5, 1.0), rotation=np.pi / 2, offset=(0.25, 0.0))
    texture = Texture(data=image, suffix=".png", placed=placed)
    material = Material("skin", base_color_texture=texture)
    shape = BlendShape("smile", [1], [[0, 0, 0.1]])
    mesh = Mesh("m", points, [4, 4], corners, uvs=uvs, shapes=(shape,), material="skin")
    return Rig("r", (mesh,), materials=(material,))


def test_vertices_are_parted_where_texture_coordinates_differ() -> None:
    rig = textured_rig()
    mesh = rig.meshes[0]
    data = character_data(rig, rig.meshes, {"skin": "data:image/png;base64,"})["meshes"][0]
    texture = data["texture"]
    assert sorted(texture["source"].tolist()) == [0, 1, 1, 2, 3, 4, 4, 5]
    corners, _ = triangle_fans(mesh.face_counts)
    np.testing.assert_array_equal(
        texture["source"][texture["triangles"]], mesh.face_indices[corners]
    )
    # Scaled, turned by 90 degrees counter-clockwise, moved.
    u, v = np.array(mesh.uvs)[corners].T
    expected = np.stack([0.25 - v, 0.5 * u], -1).transpose(1, 0, 2)
    shown = texture["coordinates"].values[texture["triangles"]]
    np.testing.assert_allclose(shown, expected, atol=1e-12)


def test_without_an_image_there_is_no_texture() -> None:
    rig = textured_rig()
    assert character_data(rig, rig.meshes)["meshes"][0]["texture"] is None
