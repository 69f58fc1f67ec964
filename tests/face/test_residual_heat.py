import numpy as np
import pytest
from worlds import make_world

from usdface.face.bound_face import bound_face
from usdface.face.residual_heat import heat_of_markers
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup


def bound(world, neutral=(0, 0)):
    mesh = world.rig.meshes[0]
    binding = Binding(tuple(world.points), np.array([*world.points.values()]))
    setup = RetargetSetup(binding, neutral=neutral, nose_tip=next(iter(world.points)))
    return setup, bound_face(mesh, setup)


def test_heat_is_whole_at_a_marker_and_fades_far_from_all() -> None:
    world = make_world()
    _, face = bound(world)
    nearest, shares = heat_of_markers(face.mesh, face.vertices)
    assert nearest.shape == shares.shape == (len(face.mesh.points), min(4, len(face.markers)))
    own = [list(nearest[v]).index(m) for m, v in enumerate(face.vertices)]
    at_markers = shares[face.vertices, own]
    np.testing.assert_allclose(at_markers, 1.0, atol=0.05)
    assert (shares >= 0).all() and shares.sum(axis=1).max() <= 1.0 + 1e-9
    one, alone = heat_of_markers(face.mesh, face.vertices[:1])
    assert one.shape[1] == 1 and alone.min() == 0.0 and alone[face.vertices[0]] == 1.0


def test_heat_is_the_same_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    _, face = bound(make_world())
    whole = heat_of_markers(face.mesh, face.vertices)
    monkeypatch.setattr("usdface.face.residual_heat._DISTANCES", 3 * len(face.mesh.points))
    pieces = heat_of_markers(face.mesh, face.vertices)
    np.testing.assert_allclose(pieces[1], whole[1], atol=1e-12)
    np.testing.assert_array_equal(pieces[0][whole[1] > 0], whole[0][whole[1] > 0])
