"""Middles of dots in images of skin whose projection is known."""

import numpy as np
import pytest
from skins import LIP, joined_lips, make_head

from usdface.face.dot_skin import dot_skin
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.dot_centres import dot_centre_offsets
from usdface.retarget.film.one_camera import PinholeCamera

CAMERA = PinholeCamera(1200.0, np.array([640.0, -480.0]))
AWAY = np.array([[0.0, 0.0, -0.5]])


def turned(degrees: float) -> Pose:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return Pose(np.array([[[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]]), AWAY)


def test_a_dot_without_skin_is_seen_where_it_is() -> None:
    head = make_head()
    skin = dot_skin(head.mesh, head.vertices, np.full(len(head.vertices), np.nan))
    assert not dot_centre_offsets(skin, head.weights[:1], turned(10.0), CAMERA).any()


def test_what_comes_nearer_is_seen_larger_and_pulls_the_middle() -> None:
    """By perspective: a slanted disc's middle lies beside its centre, to its nearer side."""
    lips, radius = joined_lips(), 0.0035
    skin = dot_skin(lips, np.array([4 * LIP + 15]), np.array([radius]))
    pose = Pose(turned(60.0).rotations, AWAY - skin.rest @ turned(60.0).rotations[0].T)
    found = dot_centre_offsets(skin, np.zeros((1, 1)), pose, CAMERA)[0, 0]
    # Of a disc with slope: points at distance t along the slant are at depth 0.5 - t sin.
    t = np.linspace(-radius, radius, 4001)
    chord = np.sqrt(radius**2 - t**2)
    depth = 0.5 - t * np.sin(np.radians(-60.0))
    x, weight = 1200.0 * t * np.cos(np.radians(60.0)) / depth, chord / depth**3
    expected = (x * weight).sum() / weight.sum()
    assert abs(expected) > 0.02
    assert found[0] == pytest.approx(expected, abs=0.008)
    assert abs(found[1]) < 0.005


def test_lips_that_part_are_seen_at_the_middle_of_both() -> None:
    lips = joined_lips()
    skin = dot_skin(lips, np.array([2 * LIP]), np.array([0.004]))
    pose = Pose(np.eye(3)[None], AWAY)
    shut, wide = (dot_centre_offsets(skin, np.array([[w]]), pose, CAMERA)[0, 0] for w in (0.0, 1.0))
    # Half of it went down by 10 mm: the mean of the skin knows, and what joins the halves is
    # stretched and counts for more in the image, at their middle.
    assert np.abs(shut).max() < 0.1
    half = 1200.0 * 0.005 / 0.5
    assert 0.0 < np.abs(wide[1]) < 0.2 * half


def test_skin_that_faces_away_is_not_seen() -> None:
    lips = joined_lips()
    skin = dot_skin(lips, np.array([4 * LIP + 15]), np.array([0.003]))
    assert not dot_centre_offsets(skin, np.zeros((1, 1)), turned(180.0), CAMERA).any()
