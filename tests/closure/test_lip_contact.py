"""Lips that are brought together, on lips known to the millimetre."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from slits import bent_slit_face, slit_face, with_correctives

from usdface.closure.lip_contact import (
    LipApertures,
    as_open_as_seen,
    lip_apertures_of,
    touching_lips,
)
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


def apertures_of_lips(mesh: Mesh) -> LipApertures:
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    apertures = lip_apertures_of(face, mesh.shape_names)
    assert apertures is not None
    return apertures


@pytest.fixture(name="apertures")
def _apertures(mesh: Mesh) -> LipApertures:
    return apertures_of_lips(mesh)


def test_no_place_is_open_further_than_it_may_be(mesh: Mesh, apertures: LipApertures) -> None:
    rng = np.random.default_rng(0)
    weights = 0.5 * rng.random((40, len(mesh.shapes)))
    largest = rng.uniform(0.0005, 0.01, (40, len(apertures.x)))
    closed = touching_lips(weights, largest, apertures)
    assert (apertures.opened(closed) <= largest + 1e-6).all()
    assert (closed >= 0).all() and (closed <= 1).all()
    np.testing.assert_array_equal(touching_lips(closed, largest, apertures), closed)


def test_frames_within_their_limits_stay(mesh: Mesh, apertures: LipApertures) -> None:
    weights = 0.5 * np.random.default_rng(0).random((20, len(mesh.shapes)))
    largest = apertures.opened(weights) + 1e-6
    np.testing.assert_array_equal(touching_lips(weights, largest, apertures), weights)
    unlimited = np.full(largest.shape, np.inf)
    np.testing.assert_array_equal(touching_lips(weights, unlimited, apertures), weights)


def test_eyes_and_brows_stay(mesh: Mesh, apertures: LipApertures) -> None:
    weights = np.full((1, len(mesh.shapes)), 0.4)
    closed = touching_lips(weights, np.full((1, len(apertures.x)), TOLERANCE), apertures)
    kept = [k for k, name in enumerate(mesh.shape_names) if name.startswith(("eye", "brow"))]
    np.testing.assert_array_equal(closed[:, kept], weights[:, kept])


def test_lips_close_over_an_open_jaw_where_the_rig_can() -> None:
    mesh = MESHES["closing"]
    apertures = apertures_of_lips(mesh)
    jaw, close = (mesh.shape_names.index(name) for name in ("jawOpen", "mouthClose"))
    weights = np.zeros((1, len(mesh.shapes)))
    weights[0, jaw] = 0.5
    closed = touching_lips(weights, np.full((1, len(apertures.x)), TOLERANCE), apertures)[0]
    assert 0.2 < closed[jaw] < 0.3
    assert 0.2 < closed[close] <= closed[jaw] + 1e-9


@pytest.mark.parametrize(
    "posed",
    [
        {"mouthUpperUpLeft": 0.8},
        {"mouthUpperUpLeft": 1.0},
        {"mouthUpperUpLeft": 0.7, "mouthUpperUpRight": 0.7},
        {"jawOpen": 0.6, "mouthUpperUpLeft": 0.9},
    ],
)
def test_a_shape_that_first_opens_further_on_its_way_to_0_is_brought_back(
    posed: dict[str, float],
) -> None:
    mesh = MESHES["bent"]
    apertures = apertures_of_lips(mesh)
    weights = np.array([[posed.get(name, 0.0) for name in mesh.shape_names]])
    largest = np.full((1, len(apertures.x)), 0.001)
    assert apertures.opened(weights).max() > 0.005
    closed = touching_lips(weights, largest, apertures)
    assert (apertures.opened(closed) <= largest + 1e-6).all()
    assert (closed >= 0).all() and (closed <= weights).all()


@pytest.mark.parametrize("kind", ["linear", "bent"])
def test_long_takes_are_held_together_in_the_memory_of_a_block(kind: str) -> None:
    mesh = with_correctives(MESHES[kind], 100)
    apertures = apertures_of_lips(mesh)
    weights = np.zeros((6000, len(mesh.shapes)))
    weights[:, mesh.shape_names.index("jawOpen")] = np.linspace(0.1, 0.5, 6000)
    largest = np.full((6000, len(apertures.x)), 0.001)
    tracemalloc.start()
    try:
        closed = touching_lips(weights, largest, apertures)
        # With the slopes of all frames at once: 117 MB and more.
        assert tracemalloc.get_traced_memory()[1] < 25e6
    finally:
        tracemalloc.stop()
    some = np.arange(0, 6000, 500)
    np.testing.assert_allclose(
        closed[some], touching_lips(weights[some], largest[some], apertures), atol=1e-12
    )


def test_a_corner_that_touches_closes_no_mouth_that_is_open_in_the_middle(
    mesh: Mesh, apertures: LipApertures
) -> None:
    """The same closure is whole where the markers of the middle touch as well."""
    weights = np.tile([[0.5 if n == "jawOpen" else 0.0 for n in mesh.shape_names]], (3, 1))
    opened = apertures.opened(weights)
    largest = np.full(opened.shape, np.inf)
    largest[:, 0] = TOLERANCE  # the corner
    closed = touching_lips(weights, largest, apertures)
    middle = int(opened[0].argmax())
    assert apertures.opened(closed)[0, middle] < 0.3 * opened[0, middle]
    seen = np.zeros(opened.shape)
    seen[0], seen[1] = opened[0], 0.2 * opened[0]
    seen[:2, 0] = 0.0
    kept = as_open_as_seen(weights, closed, largest, seen, apertures, TOLERANCE, solved=opened)
    after = apertures.opened(kept)
    assert after[0, middle] > 0.5 * opened[0, middle]
    assert after[1, middle] < after[0, middle] and after[1, middle] > 0.05 * opened[1, middle]
    np.testing.assert_array_equal(kept[2], closed[2])
    assert (after >= apertures.opened(closed) - 1e-9).all() and (after <= opened + 1e-9).all()
    once = as_open_as_seen(weights, weights, largest, seen, apertures, TOLERANCE, solved=opened)
    np.testing.assert_array_equal(once, weights)


def test_a_part_of_a_closure_is_done_once(mesh: Mesh, apertures: LipApertures) -> None:
    """A second closure of its result, towards another aim, does hardly any further part."""
    weights = np.tile([[0.5 if n == "jawOpen" else 0.0 for n in mesh.shape_names]], (5, 1))
    opened = apertures.opened(weights)
    largest = np.full(opened.shape, np.inf)
    largest[:, 0] = TOLERANCE
    seen = np.linspace(0.2, 1.0, 5)[:, None] * opened
    seen[:, 0] = 0.0
    runs = [weights]
    for _ in range(2):
        closed = touching_lips(runs[-1], largest, apertures)
        runs.append(
            as_open_as_seen(runs[-1], closed, largest, seen, apertures, TOLERANCE, solved=opened)
        )
    assert np.abs(runs[1] - runs[0]).max() > 0.1
    np.testing.assert_allclose(runs[2], runs[1], atol=1e-3)
