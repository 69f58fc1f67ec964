from dataclasses import replace

import numpy as np
from small_mesh import NAMES, POINTS, face, shape

from usdface.rigs import BlendShape, Inbetween, Mesh, Rig
from usdface.rigs.face_mesh import largest_offsets, vertex_motion


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


def test_a_larger_neck_that_all_shapes_carry_along_a_little_is_not_the_face() -> None:
    head = parts()[0]
    carried = tuple(replace(s, offsets=0.03 * s.offsets, normal_offsets=None) for s in head.shapes)
    neck = replace(face(name="neck", shapes=carried), points=2 * POINTS)
    assert Rig("x", (neck, *parts())).face().name == "head"
    assert Rig("x", (neck, head)).mesh().name == "head"  # one face, not two


def test_motion_of_a_vertex_is_the_largest_share_of_any_shape() -> None:
    wide = BlendShape("wide", [0, 2], [[0, 0, 2.0], [0, 1.0, 0]])
    small = BlendShape("small", [2, 3], [[0.1, 0, 0], [0, 0, 0.05]])
    still = BlendShape("still", [1], [[0, 0, 0]])
    assert vertex_motion((wide, small, still), 4).tolist() == [1.0, 0.0, 1.0, 0.25]


def test_the_largest_offset_of_a_vertex_is_that_of_any_shape() -> None:
    wide = BlendShape("wide", [0, 2], [[0, 0, 2.0], [0, 1.0, 0]])
    mesh = face(shapes=(wide, BlendShape("small", [2], [[3.0, 0, 4.0]])))
    assert largest_offsets(mesh).tolist() == [2.0, 0.0, 5.0, *[0.0] * 6]
