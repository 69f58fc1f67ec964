"""Lids that meet and lids that do not cross, on lids known to the millimetre."""

import numpy as np
import pytest
from slits import LID_GAP, bent_slit_face, slit_face

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.closure.lid_apertures import LidApertures, lid_apertures_of
from usdface.closure.lid_contact import close_lids, crossing, looks_open, part_crossed_lids
from usdface.face.bound_face import BoundFace
from usdface.rigs import Mesh

MESHES = {"linear": slit_face(), "bent": bent_slit_face()}
# Twice the pressing of 0.02 openings that is allowed: rims have slanted corners.
PRESSED = 0.03 * LID_GAP


@pytest.fixture(params=MESHES, name="mesh")
def _mesh(request: pytest.FixtureRequest) -> Mesh:
    return MESHES[request.param]


@pytest.fixture(name="apertures")
def _apertures(mesh: Mesh) -> LidApertures:
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    return lid_apertures_of(face, mesh.shape_names)["left"]


def random_weights(mesh: Mesh, count: int = 60) -> FloatArray:
    return np.random.default_rng(0).random((count, len(mesh.shapes)))


def test_a_closed_eye_is_closed_whatever_else_the_face_does(
    mesh: Mesh, apertures: LidApertures
) -> None:
    weights = random_weights(mesh)
    closed = close_lids(weights, np.ones(len(weights)), apertures)
    parted = part_crossed_lids(closed, apertures, np.ones(len(mesh.shapes), bool))
    least, widest = apertures.ends(parted)
    assert least.min() >= -PRESSED
    assert widest.max() <= 1e-4
    assert (parted >= 0).all() and (parted <= 1).all()


def test_no_frame_crosses_and_frames_that_do_not_stay(mesh: Mesh, apertures: LidApertures) -> None:
    weights = random_weights(mesh)
    parted = part_crossed_lids(weights, apertures, np.ones(len(mesh.shapes), bool))
    assert crossing(weights, apertures).max() > 0.001
    assert crossing(parted, apertures).max() <= 1e-6
    still = crossing(weights, apertures) <= 0
    assert still.any()
    np.testing.assert_array_equal(parted[still], weights[still])
    assert (parted <= weights).all()


def test_a_second_run_changes_nothing(mesh: Mesh, apertures: LidApertures) -> None:
    weights = random_weights(mesh)
    course = np.random.default_rng(1).random(len(weights)).round(1)
    free = np.ones(len(mesh.shapes), bool)
    once = part_crossed_lids(close_lids(weights, course, apertures), apertures, free)
    again = part_crossed_lids(close_lids(once, course, apertures), apertures, free)
    np.testing.assert_allclose(again, once, atol=2e-5)


def test_where_nothing_closes_nothing_changes(mesh: Mesh, apertures: LidApertures) -> None:
    weights = random_weights(mesh)
    np.testing.assert_array_equal(close_lids(weights, np.zeros(len(weights)), apertures), weights)
    course = (np.arange(len(weights)) % 2).astype(float)
    closed = close_lids(weights, course, apertures)
    np.testing.assert_array_equal(closed[::2], weights[::2])


def test_the_lid_comes_down_steadily(mesh: Mesh, apertures: LidApertures) -> None:
    weights = np.zeros((21, len(mesh.shapes)))
    weights[:, list(apertures.raisers)] = 0.7
    closed = close_lids(weights, np.linspace(0, 1, 21), apertures)
    assert (np.diff(apertures.widest(closed)) < 0).all()


def test_a_lid_that_is_half_down_closes_from_there(mesh: Mesh, apertures: LidApertures) -> None:
    """In the whole time of the closing, not only where its course passes the weight before it."""
    course = np.concatenate([np.zeros(3), [0.25, 0.5, 0.75, 1, 0.75, 0.5, 0.25], np.zeros(3)])
    weights = np.zeros((len(course), len(mesh.shapes)))
    weights[:, apertures.closer] = np.linspace(0.4, 0.3, len(course))
    weights[:, list(apertures.raisers)] = 0.1
    closed = close_lids(weights, course, apertures)
    shut, level = closed[6, apertures.closer], weights[:, apertures.closer]
    expected = level + course * (shut - level)
    np.testing.assert_allclose(closed[:, apertures.closer], expected, atol=1e-12)
    for raiser in apertures.raisers:
        np.testing.assert_allclose(closed[:, raiser], 0.1 * (1 - course), atol=1e-12)
    np.testing.assert_allclose(close_lids(closed, course, apertures), closed, atol=2e-5)


def test_a_weak_closer_gets_help_from_the_lower_lid() -> None:
    mesh = slit_face()
    blends = tuple(
        type(shape)(shape.name, shape.indices, 0.8 * shape.offsets)
        if "Blink" in shape.name
        else shape
        for shape in mesh.shapes
    )
    weak = Mesh("Face", mesh.points, mesh.face_counts, mesh.face_indices, shapes=blends)
    face = BoundFace(weak, (), np.zeros(0, int)).with_layout(())
    apertures = lid_apertures_of(face, weak.shape_names)["left"]
    closed = close_lids(np.zeros((1, len(blends))), np.ones(1), apertures)[0]
    assert closed[apertures.closer] == pytest.approx(1.0)
    assert closed[apertures.tighteners[0]] == pytest.approx(0.2 * 8 / 3, abs=0.05)
    assert apertures.widest(closed[None]) <= 1e-4


def test_weights_that_may_not_change_stay(mesh: Mesh, apertures: LidApertures) -> None:
    weights = np.zeros((1, len(mesh.shapes)))
    weights[0, [apertures.closer, *apertures.tighteners]] = 1.0
    free = np.ones(len(mesh.shapes), bool)
    free[apertures.closer] = False
    parted = part_crossed_lids(weights, apertures, free)
    assert parted[0, apertures.closer] == 1.0
    assert parted[0, apertures.tighteners[0]] < 0.2
    free[list(apertures.tighteners)] = False
    np.testing.assert_array_equal(part_crossed_lids(weights, apertures, free), weights)


def uneven(squint: tuple[int, ...]) -> LidApertures:
    """A blink that closes two places 8 mm open alike, and a squint that closes one of them more."""
    offsets = np.array([[-0.008, -0.008], [-0.006, -0.001]])
    return LidApertures(
        "left",
        np.array([0.008, 0.008]),
        BlendShapeEvaluator(offsets),
        np.array([0, 1]),
        0.008,
        closer=0,
        tighteners=squint,
        cheek_raisers=(),
        raisers=(),
        movers=np.array([True, True]),
    )


def test_a_raised_lower_lid_is_lowered_where_it_would_leave_shut_lids_open() -> None:
    free = np.ones(2, bool)
    squeezed = np.stack([np.linspace(0.5, 1.0, 101), np.full(101, 0.8)], axis=1)
    before = part_crossed_lids(squeezed, uneven(()), free)
    apertures = uneven((1,))
    after = part_crossed_lids(squeezed, apertures, free)
    assert apertures.widest(before)[-1] > 0.4 * apertures.opening
    assert apertures.widest(after)[-1] == pytest.approx(looks_open(apertures), abs=2e-6)
    assert crossing(after, apertures).max() < 1e-6
    # No jump where it begins, and nothing where the eye was as far open before.
    assert np.abs(np.diff(after, axis=0)).max() < 0.05
    half = np.array([[0.45, 0.8]])
    np.testing.assert_array_equal(
        part_crossed_lids(half, apertures, free), part_crossed_lids(half, uneven(()), free)
    )
    np.testing.assert_allclose(part_crossed_lids(after, apertures, free), after, atol=1e-4)


def laughing(shut: FloatArray, noise: float) -> tuple[FloatArray, LidApertures]:
    """Return weights of a laugh that shuts the eyes by `shut` (F,), and the lids of an eye.

    The apertures of three places are those of ICT [mm] at its blink, squint, raised cheek and
    smile: the first closes last, the second first.
    """
    blink, squint = [-5.26, -7.88, -4.1], [-1.29, -2.25, -1.29]
    cheek, smile = [-1.35, -2.42, -1.88], [-0.22, -0.52, -0.52]
    apertures = LidApertures(
        "left",
        0.001 * np.array([5.64, 8.78, 3.97]),
        BlendShapeEvaluator(0.001 * np.array([blink, squint, cheek, smile])),
        np.arange(3),
        0.0077,
        closer=0,
        tighteners=(1,),
        cheek_raisers=(2,),
        raisers=(),
        movers=np.ones(4, bool),
    )
    weights = np.tile([0.0, 0.55, 0.75, 0.5], (len(shut), 1))
    weights[:, 0] = shut
    return weights + noise * np.random.default_rng(0).normal(size=weights.shape), apertures


@pytest.mark.parametrize(("shut", "fade"), [(0.86, 0), (0.82, 0), (0.86, 18), (0.78, 18)])
def test_eyes_held_shut_in_a_laugh_are_as_steady_as_their_weights(shut: float, fade: int) -> None:
    weights, apertures = laughing(np.full(200, shut), 0.008)
    parted = part_crossed_lids(weights, apertures, np.ones(4, bool), fade=fade)
    steps, was = (np.abs(np.diff(each, axis=0)).max(axis=0) for each in (parted, weights))
    assert (steps <= 1.2 * was).all()
    assert (np.ptp(parted, axis=0) <= 1.2 * np.ptp(weights, axis=0)).all()
    assert apertures.widest(parted).max() < looks_open(apertures) + 2e-6
    assert crossing(parted, apertures).max() < 1e-6
    # The lower lid gives way no further than it takes.
    assert apertures.widest(parted).min() > looks_open(apertures) - (5e-5 if fade else 2e-6)


def test_the_lower_lid_gives_way_over_some_frames() -> None:
    blink = np.concatenate([np.zeros(30), np.linspace(0, 0.72, 6), np.full(40, 0.72)])
    weights, apertures = laughing(np.concatenate([blink, blink[::-1]]), 0.0)
    free, fade = np.ones(4, bool), 18
    at_once, parted = (part_crossed_lids(weights, apertures, free, fade=n) for n in (0, fade))
    steps = [np.abs(np.diff(each[:, 1:3], axis=0)).max() for each in (at_once, parted)]
    assert steps[0] > 0.25 and steps[1] < 0.1
    assert (parted[:, 1:3] <= at_once[:, 1:3] + 1e-9).all()
    assert crossing(parted, apertures).max() < 1e-6
    # The upper lid takes its place: an eye is open as far as without.
    opened = apertures.least(weights) > 0
    np.testing.assert_allclose(
        apertures.least(parted)[opened], apertures.least(weights)[opened], atol=1e-6
    )
    np.testing.assert_array_equal(parted[: 30 - fade], weights[: 30 - fade])
    np.testing.assert_array_equal(part_crossed_lids(parted, apertures, free, fade=fade), parted)
