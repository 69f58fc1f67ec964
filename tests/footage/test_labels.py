import numpy as np

from usdface.footage.face_names import BoundVertices
from usdface.footage.labels import DotName, name_tracks


def test_a_name_without_a_dot_does_not_push_its_neighbour_onto_a_speck() -> None:
    speck, lid, cheek, jaw = (0.0, 0.0), (10.0, 0.0), (0.0, 30.0), (0.0, 70.0)
    places = np.array([[speck, lid, cheek]])
    named = [DotName("lid", *lid), DotName("cheek", *cheek), DotName("jaw", *jaw)]
    assert name_tracks(places, named) == (("dot_01", "lid", "cheek"), ("jaw",))


def test_the_users_names_go_before_those_of_a_face() -> None:
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), axis=-1).reshape(-1, 2)
    grid[:, 0] += 0.2 * grid[:, 1] ** 2  # no turn or shift brings it onto itself
    points = np.column_stack([grid * (0.01, -0.01), np.zeros(12)])
    face = BoundVertices(tuple(f"m{k}" for k in range(12)), points)
    places = (100 + 40 * grid)[None]
    names, left = name_tracks(places, [DotName("chin", *places[0, 5])], face)
    assert names == tuple("chin" if k == 5 else f"m{k}" for k in range(12))
    assert left == ("m5",)
