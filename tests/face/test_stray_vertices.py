from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.face.stray_vertices import report_stray
from usdface.rigs import BlendShape, Rig


@pytest.fixture
def rig() -> Rig:
    return make_world().rig


def with_mesh(rig: Rig, **changes: object) -> Rig:
    return replace(rig, meshes=(replace(rig.meshes[0], **changes),))


def test_a_good_rig_has_none(rig: Rig) -> None:
    assert report_stray(rig) == []


@pytest.mark.parametrize("far", [0.55, 100.0, 1e6])
def test_a_shape_that_moves_a_vertex_far_off_is_named(rig: Rig, far: float) -> None:
    mesh = rig.meshes[0]
    shape = mesh.shapes[0]
    offsets = np.array(shape.offsets)
    offsets[0] = [far, 0.0, 0.0]
    bad = BlendShape(shape.name, shape.indices, offsets)
    (found,) = report_stray(with_mesh(rig, shapes=(bad, *mesh.shapes[1:])))
    assert (found.code, found.severity) == ("POINT_STRAY", "warning")
    assert found.where == f"{mesh.name}/{shape.name}"
    assert f"point {shape.indices[0]} moves by" in found.message


def test_a_vertex_far_off_is_named(rig: Rig) -> None:
    points = np.array(rig.meshes[0].points)
    points[7] = [100.0, 0.0, 0.0]
    (found,) = report_stray(with_mesh(rig, points=points))
    assert found.where == rig.meshes[0].name and "point 7 lies far off" in found.message
