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


def test_lashes_that_reach_as_far_as_the_lids_are_not_the_face() -> None:
    """Of a rig whose shapes close the eyes only: the skin around the lids moves less than they."""
    lid = BlendShape("blink", [0, 1, 2, 3], [[0, -0.01, 0]] * 2 + [[0, -0.0005, 0]] * 2)
    points = POINTS.copy()
    points[:4] = [[-0.05, 0, 0], [0.05, 0, 0], [-0.07, 0, 0], [0.07, 0, 0]]
    head = replace(face(name="head", shapes=(lid,)), points=points)
    lash = BlendShape("blink", [0, 1], [[0, -0.012, 0]] * 2)
    lashes = replace(face(name="lashes", shapes=(lash,)), points=1.2 * points)
    assert Rig("x", (lashes, head)).face().name == "head"


def test_a_face_in_a_body_that_its_shapes_hardly_move_is_the_face() -> None:
    head, teeth = parts()[0], parts()[1]
    count = len(head.points)
    shapes = []
    for s in head.shapes:
        offsets = np.full((40 * count, 3), 1e-6)
        offsets[s.indices] = s.offsets
        shapes.append(BlendShape(s.name, np.arange(len(offsets)), offsets))
    body = np.concatenate([head.points, np.tile(head.points, (39, 1))])
    whole = replace(head, name="body", points=body, shapes=tuple(shapes))
    assert Rig("x", (teeth, whole)).face().name == "body"


def test_motion_of_a_vertex_is_the_largest_share_of_any_shape() -> None:
    wide = BlendShape("wide", [0, 2], [[0, 0, 2.0], [0, 1.0, 0]])
    small = BlendShape("small", [2, 3], [[0.1, 0, 0], [0, 0, 0.05]])
    still = BlendShape("still", [1], [[0, 0, 0]])
    assert vertex_motion((wide, small, still), 4).tolist() == [1.0, 0.0, 1.0, 0.25]


def test_the_largest_offset_of_a_vertex_is_that_of_any_shape() -> None:
    wide = BlendShape("wide", [0, 2], [[0, 0, 2.0], [0, 1.0, 0]])
    mesh = face(shapes=(wide, BlendShape("small", [2], [[3.0, 0, 4.0]])))
    assert largest_offsets(mesh).tolist() == [2.0, 0.0, 5.0, *[0.0] * 6]
