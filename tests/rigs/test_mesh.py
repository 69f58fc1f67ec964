from dataclasses import replace

import numpy as np
import pytest
from small_mesh import DENSE, POINTS, face, shape

from usdface.errors import InputError
from usdface.rigs import Inbetween, MaterialSubset, Skeleton, Skin


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


def test_a_mesh_shows_its_own_material_and_those_of_its_subsets() -> None:
    subsets = (MaterialSubset("lips", np.array([0])), MaterialSubset("skin", np.array([1])))
    assert face(material="skin", subsets=subsets).materials == ("skin", "lips", "skin")


def test_offsets_at_some_vertices_are_the_dense_ones() -> None:
    wanted = np.array([8, 0, 3, 3, 5])
    np.testing.assert_array_equal(face().offsets_at(wanted), DENSE[:, wanted])
    empty = face(shapes=(shape([]),))
    np.testing.assert_array_equal(empty.offsets_at(wanted), np.zeros((1, 5, 3)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": np.full((9, 3), np.nan)}, "finite"),
        ({"normals": np.zeros((8, 3))}, "normals have shape (8, 3); expected (9, 3)"),
        ({"uvs": np.zeros((7, 3))}, "uvs have shape (7, 3); expected (7, 2)"),
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
