"""Errors of features: each part by itself, and the slope of the skin around a marker."""

import numpy as np
from skins import flat_skin, joined_lips

from usdface.face.bound_face import BoundFace
from usdface.geometry.marker_spread import rms_radius
from usdface.rigs import BlendShape
from usdface.rule_design.feature_errors import feature_errors, misplacement


def test_parts_add_up_as_squares():
    own = np.array([0.003, 0.0, 0.004, 0.0, 0.0, 0.0])
    noise, misplaced = np.full(6, 0.0003), np.array([0.0, 0.001, 0, 0, 0, 0])
    errors = feature_errors(own, noise, misplaced)
    np.testing.assert_array_equal(errors.noise, noise)
    still = 0.0003**2 + 0.0005**2
    moving = still + (0.3 * 0.005) ** 2
    expected = [moving, moving + 0.001**2, moving, still, still, still]
    np.testing.assert_allclose(errors.total**2, expected)


def test_a_marker_is_off_by_the_slope_of_the_motion_around_it():
    """Of the six nearest two lie along the slope, two across it, and two diagonally."""
    points = flat_skin().points
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    slope = 0.5 * points @ along[:, None] * [0.0, 0.0, 1.0]
    level = np.full_like(points, 0.01)
    shapes = (BlendShape.from_dense("slope", slope), BlendShape.from_dense("level", level))
    inner = np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[:9]
    face = BoundFace(flat_skin(shapes), tuple(map(str, inner)), inner)
    found = misplacement(face, np.array([[1.0, 0.0], [0.0, 1.0], [0.5, 1.0]])).reshape(3, 9, 3)
    away = 0.03 * rms_radius(points[inner])
    expected = np.zeros((3, 9, 3))
    expected[[0, 2], :, 2] = np.array([[0.5], [0.25]]) * away * np.sqrt(3 / 7)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_marker_at_the_rim_of_a_lip_may_sit_on_the_other_one():
    lips = joined_lips()
    upper = lips.points[:, 1] > 0
    middle, height = lips.points[:, 0].mean(), lips.points[:, 1]
    aside = np.abs(lips.points[:, 0] - middle)
    rim, far = (int(np.lexsort((aside, sign * height, ~upper))[0]) for sign in (1, -1))
    face = BoundFace(lips, ("rim", "far"), np.array([rim, far]))
    found = misplacement(face, np.ones((1, 1))).reshape(2, 3)
    assert found[0, 1] > 0.001 and found[1, 1] == 0.0


def test_of_a_dense_skin_few_vertices_are_looked_at(monkeypatch):
    """As many as it takes: every second one has the same slope."""
    points = flat_skin(columns=60, rows=60).points
    along = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    shape = BlendShape.from_dense("slope", 0.5 * points @ along[:, None] * [0.0, 0.0, 1.0])
    skin = flat_skin((shape,), columns=60, rows=60)
    spread = np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[[0, 1500, 1600]]
    face = BoundFace(skin, ("a", "b", "c"), spread)
    whole = misplacement(face, np.ones((1, 1)))
    monkeypatch.setattr("usdface.rule_design.feature_errors._MOST", 12)
    np.testing.assert_allclose(misplacement(face, np.ones((1, 1))), whole, rtol=0.3)
