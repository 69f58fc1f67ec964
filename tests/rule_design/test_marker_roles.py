import numpy as np
import pytest

from usdface.rule_design.marker_roles import (
    degree_prefixes,
    direction_name,
    direction_names,
    known_roles,
    marker_features,
    marker_sides,
    role_names,
)


def test_roles_are_unique_identifiers():
    roles = role_names(["Brow L", "brow_l", "41", "Mund-Ecke"])
    assert roles == ["brow_l", "brow_l_", "m_41", "mund_ecke"]


def test_variables_go_through_the_axes_of_each_marker():
    names = [v.name for v in marker_features(["a", "b"])]
    assert names == ["a_x", "a_y", "a_z", "b_x", "b_y", "b_z"]


def test_sides_are_the_characters_and_the_midline_has_none():
    places = np.array([[0, 0, 0.1], [0.05, 0, 0], [-0.05, 0, 0], [0.001, 0.05, 0]])
    assert marker_sides(places, 0) == [0, 1, -1, 0]


@pytest.mark.parametrize("sign", [1, -1])
def test_mirrored_markers_have_the_same_words(sign):
    assert direction_name("x", sign, 1) == direction_name("x", -sign, -1)
    assert direction_name("y", sign, 1) == direction_name("y", sign, -1)


def test_degrees_are_distinct_words():
    assert [degree_prefixes(n) for n in (1, 2, 3)] == [
        ("",),
        ("slightly_", ""),
        ("slightly_", "", "far_"),
    ]
    assert len(set(degree_prefixes(5))) == 5


def test_roles_that_are_given_go_before_labels():
    names = ("Chin", "Lip", "Nose")
    assert known_roles(names, {}) == {"chin": "Chin", "lip": "Lip", "nose": "Nose"}
    given = known_roles(names, {"lip": "Chin", "far": "Elsewhere", "no name": "Nose"})
    assert given == {"lip": "Chin", "lip_": "Lip", "nose": "Nose"}
    assert list(given.values()) == list(names)


def test_words_follow_the_side_of_the_marker():
    places = np.array([[0, 0, 0.1], [0.05, 0, 0], [-0.05, 0, 0]])
    words = direction_names(places, 0)
    assert words[0] == ("right", "left")
    assert words[3] == ("inward", "outward")
    assert words[6] == ("outward", "inward")
    assert words[7:] == (("lowered", "raised"), ("back", "forward"))
