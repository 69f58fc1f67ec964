from dataclasses import replace

import pytest
from small_mesh import NAMES, POINTS, face, shape

from usdface.errors import InputError
from usdface.rigs import Mesh, Rig


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
