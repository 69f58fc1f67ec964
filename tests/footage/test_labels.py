import numpy as np

from usdface.footage.labels import NamedPlace, name_tracks


def test_a_name_without_a_dot_does_not_push_its_neighbour_onto_a_speck() -> None:
    speck, lid, cheek, jaw = (0.0, 0.0), (10.0, 0.0), (0.0, 30.0), (0.0, 70.0)
    places = np.array([[speck, lid, cheek]])
    named = [NamedPlace("lid", *lid), NamedPlace("cheek", *cheek), NamedPlace("jaw", *jaw)]
    assert name_tracks(places, named) == (("dot_01", "lid", "cheek"), ("jaw",))
