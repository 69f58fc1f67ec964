from dataclasses import replace

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig, Skeleton, Skin

RNG = np.random.default_rng(11)
POINTS = RNG.normal(size=(9, 3))
DENSE = np.where(RNG.random((3, 9, 1)) < 0.5, RNG.normal(size=(3, 9, 3)), 0.0)
NAMES = ("jawOpen", "smile L", "口")


def shape(indices: list[int], name: str = "a", **fields: object) -> BlendShape:
    return BlendShape(name, indices, np.ones((len(indices), 3)), **fields)  # type: ignore[arg-type]


def face(**changes: object) -> Mesh:
    shapes = tuple(BlendShape.from_dense(n, d) for n, d in zip(NAMES, DENSE, strict=True))
    given = {"points": POINTS, "face_counts": [3, 4], "face_indices": [0, 1, 2, 3, 4, 5, 6]}
    return Mesh(**({"name": "face"} | given | {"shapes": shapes} | changes))  # type: ignore[arg-type]


def test_nothing_in_a_rig_can_be_changed() -> None:
    between = Inbetween("half", 0.5, np.ones((2, 3)), np.ones((2, 3)))
    bent = shape([1, 4], normal_offsets=np.ones((2, 3)), inbetweens=(between,))
    skin = Skin(np.zeros((9, 1)), np.ones((9, 1)))
    mesh = face(normals=POINTS, uvs=np.zeros((7, 2)), skin=skin)
    skeleton = Skeleton(("root",), ("root",), np.eye(4)[None], np.eye(4)[None])
    arrays = [
        *(mesh.points, mesh.normals, mesh.uvs, mesh.face_counts, mesh.face_indices),
        *(bent.indices, bent.offsets, bent.normal_offsets),
        *(between.offsets, between.normal_offsets),
        *(skin.joints, skin.weights, skeleton.bind, skeleton.rest),
    ]
    for array in arrays:
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_offsets_at_some_vertices_are_the_dense_ones() -> None:
    wanted = np.array([8, 0, 3, 3, 5])
    np.testing.assert_array_equal(face().offsets_at(wanted), DENSE[:, wanted])
    empty = face(shapes=(shape([]),))
    np.testing.assert_array_equal(empty.offsets_at(wanted), np.zeros((1, 5, 3)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.full((9, 3), np.nan)}, "finite"),
        ({"points": np.zeros((9, 2))}, "finite, shape"),
        ({"face_counts": [3, 3]}, "add up to 6"),
        ({"face_indices": [0, 1, 2, 3, 4, 5, 9]}, "outside 0 to 8"),
        ({"face_indices": [0, 1, 2, 3, 4, 5, -1]}, "outside 0 to 8"),
        ({"shapes": (shape([2, 9]),)}, "'a': a point index is outside 0 to 8"),
        ({"shapes": (shape([-1, 2]),)}, "outside 0 to 8"),
        ({"shapes": (shape([1]), shape([2]))}, "'a' twice"),
        ({"shapes": (replace(shape([1]), offsets=[[np.nan, 0, 0]]),)}, "finite"),
    ],
)
def test_a_mesh_that_makes_no_sense(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        face(**changes)
    assert message in str(caught.value) and "'face'" in str(caught.value)


def test_transforms_fit_their_joints() -> None:
    with pytest.raises(InputError, match="2, 4, 4"):
        Skeleton(("a", "a/b"), ("a", "b"), np.eye(4)[None], np.eye(4)[None])


def test_a_rig_has_each_name_once_in_order_of_appearance() -> None:
    teeth = face(shapes=(shape([1], "teeth"), shape([2], "jawOpen")))
    assert Rig("r", (face(), teeth)).shape_names == (*NAMES, "teeth")


def test_a_mesh_is_found_by_name_by_path_or_as_the_face() -> None:
    bare = Mesh("hair", POINTS, [3], [0, 1, 2], path="/Asset/hair")
    rig = Rig("r", (bare, replace(face(), path="/Asset/face")))
    assert rig.mesh() is rig.mesh("face") is rig.mesh("/Asset/face") is rig.meshes[1]
    for name, result in (("neck", "it has /Asset/hair, /Asset/face"), ("hair", "no blend shapes")):
        with pytest.raises(InputError, match=result):
            rig.mesh(name)
    with pytest.raises(InputError, match="no blend shapes"):
        Rig("r", (bare,)).mesh()
    with pytest.raises(InputError, match="2 faces"):
        Rig("r", (face(), face())).mesh()
    eye = face(name="eye", shapes=(shape([1], "gaze"),))
    assert Rig("r", (eye, *rig.meshes)).mesh() is rig.meshes[1]


def test_a_mesh_whose_shapes_move_nothing_is_not_the_face() -> None:
    """As where a file gives each of a head's materials a mesh with all of its morph targets."""
    still = face(name="still", shapes=tuple(shape([], name) for name in (*NAMES, "more")))
    assert Rig("x", (still, face())).face().name == "face"
    assert Rig("x", (still, face())).mesh().name == "face"
    assert Rig("x", (still,)).face().name == "still"
    bulge = Inbetween("half", 0.5, np.ones((1, 3)))
    way = BlendShape("way", [0], np.zeros((1, 3)), inbetweens=(bulge,))
    assert Rig("x", (still, face(name="way", shapes=(way,)))).mesh().name == "way"


def test_of_meshes_with_the_same_shapes_the_face_is_the_largest() -> None:
    """As lashes and teeth that carry all shapes of a head."""
    lashes = replace(face(name="lashes"), points=0.1 * face().points)
    for meshes in ((lashes, face()), (face(), lashes)):
        assert Rig("x", meshes).face().name == "face"


def parts(*more: Mesh) -> tuple[Mesh, ...]:
    """A head of four shapes, and a tongue with these and one of its own."""
    names = ("jawOpen", "smile", "blink", "brow")
    head = face(name="head", shapes=tuple(shape([0, 1, 2], name) for name in names))
    tongue = face(name="tongue", shapes=(*head.shapes, shape([0, 1, 2], "tongueOut")))
    return (head, replace(tongue, points=0.2 * POINTS), *more)


def test_a_tongue_with_a_shape_more_than_the_head_is_not_the_face() -> None:
    for meshes in (parts(), parts()[::-1]):
        assert Rig("x", meshes).face().name == "head"


def test_larger_clothes_with_nearly_as_many_shapes_of_their_own_are_not_the_face() -> None:
    folds = tuple(shape([0, 1, 2], name) for name in ("elbow", "knee", "jawOpen", "bend"))
    shirt = replace(face(name="shirt", shapes=folds), points=9 * POINTS)
    assert Rig("x", parts(shirt)).face().name == "head"


def test_a_larger_beard_that_a_part_of_the_shapes_moves_is_not_the_face() -> None:
    head = parts()[0]
    beard = replace(face(name="beard", shapes=head.shapes[:2]), points=2 * POINTS)
    assert Rig("x", (beard, *parts())).face().name == "head"
