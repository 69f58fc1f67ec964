"""Lips that are brought together, on lips known to the millimetre."""

from dataclasses import replace

import numpy as np
import pytest
from slits import bent_slit_face, slit_face

from usdface.closure.lip_contact import LipGaps, largest_gaps, lip_gaps_of, touching_lips
from usdface.closure.lip_signal import LipDistances
from usdface.face.bound_face import BoundFace
from usdface.rigs import BlendShape, Mesh

TOLERANCE = 0.0005


def with_mouth_close(mesh: Mesh) -> Mesh:
    jaw = next(shape for shape in mesh.shapes if shape.name == "jawOpen")
    close = BlendShape("mouthClose", jaw.indices, -0.95 * jaw.offsets)
    return replace(mesh, shapes=(*mesh.shapes, close))


MESHES = {"linear": slit_face(), "bent": bent_slit_face(), "closing": with_mouth_close(slit_face())}


@pytest.fixture(params=MESHES, name="mesh")
def _mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]


@pytest.fixture(name="gaps")
def _gaps(mesh: Mesh) -> LipGaps:
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    gaps = lip_gaps_of(face, mesh.shape_names)
    assert gaps is not None
    return gaps


def test_no_place_is_open_further_than_it_may_be(mesh: Mesh, gaps: LipGaps) -> None:
    rng = np.random.default_rng(0)
    weights = 0.5 * rng.random((40, len(mesh.shapes)))
    largest = rng.uniform(0.0005, 0.01, (40, len(gaps.x)))
    closed = touching_lips(weights, largest, gaps)
    assert (gaps.opened(closed) <= largest + 1e-6).all()
    assert (closed >= 0).all() and (closed <= 1).all()
    np.testing.assert_array_equal(touching_lips(closed, largest, gaps), closed)


def test_frames_within_their_limits_stay(mesh: Mesh, gaps: LipGaps) -> None:
    weights = 0.5 * np.random.default_rng(0).random((20, len(mesh.shapes)))
    largest = gaps.opened(weights) + 1e-6
    np.testing.assert_array_equal(touching_lips(weights, largest, gaps), weights)
    unlimited = np.full(largest.shape, np.inf)
    np.testing.assert_array_equal(touching_lips(weights, unlimited, gaps), weights)


def test_eyes_and_brows_stay(mesh: Mesh, gaps: LipGaps) -> None:
    weights = np.full((1, len(mesh.shapes)), 0.4)
    closed = touching_lips(weights, np.full((1, len(gaps.x)), TOLERANCE), gaps)
    kept = [k for k, name in enumerate(mesh.shape_names) if name.startswith(("eye", "brow"))]
    np.testing.assert_array_equal(closed[:, kept], weights[:, kept])


def test_lips_close_over_an_open_jaw_where_the_rig_can() -> None:
    mesh = MESHES["closing"]
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    gaps = lip_gaps_of(face, mesh.shape_names)
    assert gaps is not None
    jaw, close = (mesh.shape_names.index(name) for name in ("jawOpen", "mouthClose"))
    weights = np.zeros((1, len(mesh.shapes)))
    weights[0, jaw] = 0.5
    closed = touching_lips(weights, np.full((1, len(gaps.x)), TOLERANCE), gaps)[0]
    assert 0.2 < closed[jaw] < 0.3
    assert 0.2 < closed[close] <= closed[jaw] + 1e-9


def test_only_markers_that_contradict_the_solve_count() -> None:
    apart, now = np.array([[0.0, 0.001, 0.004]]), np.zeros(1)
    agreeing = largest_gaps(LipDistances(apart, apart, 1e-5), TOLERANCE, now)
    assert np.isinf(agreeing).all()
    sure = largest_gaps(LipDistances(apart, apart + 0.003, 1e-5), TOLERANCE, now)[0]
    assert sure[0] == TOLERANCE
    assert (np.diff(sure) > 0).all() and sure[2] > 0.01
    noisy = largest_gaps(LipDistances(apart, apart + 0.003, 0.002), TOLERANCE, now)
    assert np.isinf(noisy).all()


def test_lips_that_rest_on_each_other_do_not_chatter() -> None:
    """A contradiction that comes and goes within half a second holds; a longer pause ends it."""
    times = np.arange(240) / 60
    seen = np.zeros((240, 1))
    shown = np.full((240, 1), 0.003)
    shown[60:80] = shown[150:210] = 0.0
    largest = largest_gaps(LipDistances(seen, shown, 1e-5), TOLERANCE, times)[:, 0]
    np.testing.assert_allclose(largest[:140], TOLERANCE)
    assert np.isinf(largest[170:190]).all()


def test_lips_that_the_markers_show_apart_open_within_a_held_contact() -> None:
    times = np.arange(240) / 60
    seen, shown = np.zeros((240, 1)), np.full((240, 1), 0.003)
    seen[60:72] = shown[60:72] = 0.006
    largest = largest_gaps(LipDistances(seen, shown, 1e-5), TOLERANCE, times)[:, 0]
    assert (largest[60:72] > 0.03).all()
