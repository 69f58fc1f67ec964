from dataclasses import replace

import numpy as np
from dense_offsets import dense_offsets

from usdface.certificate.compare import certify, sample_frames
from usdface.certificate.evaluated_mesh import EvaluatedMesh
from usdface.certificate.linear_morph import LinearMorph
from usdface.certificate.stored_steps import HalfSteps, StoredSteps

RNG = np.random.default_rng(3)
FRAMES = np.arange(8)
POINTS = RNG.normal(size=(30, 3))
MOVES = RNG.normal(size=(2, 30, 3))
WEIGHTS = RNG.uniform(size=(8, 2))


def mesh(points: np.ndarray, turn: float = 0.0, **more: object) -> EvaluatedMesh:
    normals = np.broadcast_to([np.sin(turn), 0, np.cos(turn)], points.shape)
    made = EvaluatedMesh(
        "m", ("a", "b"), WEIGHTS, lambda frames: points[frames], lambda frames: normals[frames]
    )
    return replace(made, **more)


ANIMATED = POINTS + np.tensordot(WEIGHTS, MOVES, 1)


def test_what_is_split_and_shuffled_is_the_same() -> None:
    order = RNG.permutation(np.r_[np.arange(30), np.arange(5)])
    certificate = certify([mesh(ANIMATED)], [mesh(ANIMATED[:, order])], FRAMES)
    assert certificate.vertex_largest == certificate.normal_largest == 0
    assert certificate.weights == {"m/a": 0, "m/b": 0}
    assert certificate.findings("x") == []
    size = np.linalg.norm(np.ptp(ANIMATED[0], axis=0))
    assert certificate.diagonal == size


def test_points_that_coincide_at_rest_are_told_apart_by_their_motion() -> None:
    twice = np.concatenate([ANIMATED, np.broadcast_to(ANIMATED[:1], ANIMATED.shape)], 1)
    assert certify([mesh(twice)], [mesh(twice[:, ::-1])], FRAMES).vertex_largest == 0


def test_what_was_asked_for_is_an_error_but_no_warning() -> None:
    cut = ANIMATED.copy()
    cut[5, 7, 1] += 2e-3
    source = mesh(ANIMATED, requested=mesh(cut, np.radians(3)))
    certificate = certify([source], [mesh(cut[:, ::-1], np.radians(3))], FRAMES)
    np.testing.assert_allclose(certificate.vertex_largest, 2e-3, rtol=1e-9)
    np.testing.assert_allclose(certificate.normal_largest, 3, rtol=1e-9)
    assert certificate.vertex_excess == certificate.normal_excess == 0
    assert certificate.findings("x") == []
    certificate = certify([source], [mesh(ANIMATED)], FRAMES)  # not done, though asked for
    assert certificate.vertex_largest == 0
    np.testing.assert_allclose(certificate.vertex_excess, 2e-3, rtol=1e-9)


def test_known_errors_are_found() -> None:
    off = ANIMATED.copy()
    off[5, 7, 1] += 2e-3
    other = mesh(off, np.radians(3), weights=WEIGHTS + np.array([0, 0.25]))
    certificate = certify([mesh(ANIMATED)], [other], FRAMES, 0.5, FRAMES)
    np.testing.assert_allclose(certificate.vertex_largest, 2e-3, rtol=1e-9)
    np.testing.assert_allclose(certificate.vertex_mean, 2e-3 / (8 * 30), rtol=1e-9)
    np.testing.assert_allclose(certificate.normal_largest, 3, rtol=1e-9)
    np.testing.assert_allclose(certificate.normal_mean, 3, rtol=1e-9)
    np.testing.assert_allclose(list(certificate.weights.values()), [0, 0.25])
    (found,) = certificate.findings("x")
    assert (found.code, found.severity) == ("CONVERSION_INEXACT", "warning")
    for word in ("vertices by 2 mm", "normals by 3 degrees", "weights by 0.25", "times by 0.5 s"):
        assert word in found.message
    assert set(certificate.summary) <= set(certificate.as_dict())


def test_what_is_no_number_agrees_with_nothing() -> None:
    weights = WEIGHTS.copy()
    weights[2, 1] = np.nan
    nowhere = np.full(ANIMATED.shape, np.nan)
    other = mesh(ANIMATED, weights=weights, normals_at=lambda frames: nowhere[frames])
    certificate = certify([mesh(ANIMATED)], [other], FRAMES)
    assert certificate.normal_largest == certificate.weights["m/b"] == np.inf
    (found,) = certificate.findings("x")
    assert "normals by inf degrees; weights by inf" in found.message


def test_a_vertex_that_is_gone_is_an_error_on_either_side() -> None:
    far = np.concatenate([ANIMATED, np.full((8, 1, 3), 50.0)], 1)
    assert certify([mesh(far)], [mesh(ANIMATED)], FRAMES).vertex_largest > 40
    assert certify([mesh(ANIMATED)], [mesh(far)], FRAMES).vertex_largest > 40


def test_names_are_mapped_and_losses_named() -> None:
    source = [mesh(ANIMATED), mesh(ANIMATED, name="n")]
    renamed = [mesh(ANIMATED, name="k", shapes=("a", "c")), mesh(ANIMATED, name="n")]
    certificate = certify(source, renamed, FRAMES)
    assert certificate.names == {"m": "k", "m/b": "k/c"}
    assert certificate.missing == ()
    fewer = mesh(ANIMATED, name="n", shapes=("b",), weights=WEIGHTS[:, 1:])
    certificate = certify(source, [fewer], FRAMES)
    assert certificate.missing == ("m", "n/a")
    assert certificate.weights == {"n/b": 0}
    assert [f.code for f in certificate.findings("x")] == ["CONVERSION_INEXACT"]


def test_rounding_of_a_mesh_without_size_is_no_loss() -> None:
    """As of one that is scaled to nothing at rest."""
    nowhere = certify([mesh(0 * ANIMATED)], [mesh(0 * ANIMATED)], FRAMES)
    assert nowhere.diagonal == 0
    assert replace(nowhere, vertex_largest=3.7e-9).findings("x") == []
    (found,) = replace(nowhere, vertex_largest=1e-6, vertex_excess=1e-6).findings("x")
    assert found.code == "CONVERSION_INEXACT"


def test_names_count_before_places() -> None:
    pair = [mesh(ANIMATED), mesh(ANIMATED + 1, name="n")]
    certificate = certify(pair, pair[::-1], FRAMES)
    assert certificate.vertex_largest == 0 and certificate.names == {}


def test_without_normals_there_is_no_angle() -> None:
    bare = mesh(ANIMATED, normals_at=lambda frames: None)
    for pair in ((bare, mesh(ANIMATED)), (mesh(ANIMATED), bare)):
        certificate = certify([pair[0]], [pair[1]], FRAMES)
        assert certificate.normal_largest is None and certificate.vertex_largest == 0


def test_nothing_against_nothing() -> None:
    certificate = certify([], [], FRAMES[:1])
    assert certificate.findings("x") == [] and certificate.vertex_largest == 0


def test_some_frames_are_spread_and_within_the_budget() -> None:
    assert sample_frames(10, 5, 1000).tolist() == list(range(10))
    assert sample_frames(101, 100, 1100).tolist() == list(range(0, 101, 10))
    assert sample_frames(9, 10**9, 1).tolist() == [0, 8]
    assert sample_frames(1, 10**9, 1).tolist() == [0]


def test_weights_may_be_off_by_what_the_rounding_of_times_makes_of_them() -> None:
    """A weight that jumps by 1 within a millisecond, an hour in: its keys are 0.2 ms apart."""
    times = 3600 + np.array([0.0, 1, 1.001, 2])
    weights = np.array([0.0, 0, 1, 1])[:, None]
    points = np.broadcast_to(POINTS, (4, 30, 3))
    one = mesh(points, shapes=("a",), weights=weights)
    for frame, named in ((1, False), (2, False), (0, True), (3, True)):
        off = weights.copy()
        off[frame] += 0.2
        other = mesh(points, shapes=("a",), weights=off)
        certificate = certify([one], [other], np.arange(4), 0.0, times)
        np.testing.assert_allclose(certificate.weights["m/a"], 0.2)
        assert bool(certificate.findings("x")) is named


def summed(moves: np.ndarray = MOVES, frames: int = 120) -> EvaluatedMesh:
    weights = np.random.default_rng(4).uniform(size=(frames, len(moves)))
    moved = moves.astype(np.float32)
    points = POINTS + np.tensordot(weights, moved, 1)
    return EvaluatedMesh(
        "m",
        ("a", "b"),
        weights,
        lambda f: points[f],
        lambda f: None,
        lambda f: LinearMorph(weights[f], POINTS, dense_offsets(moved)),
    )


def test_many_frames_are_summed_and_say_the_same() -> None:
    off = MOVES.copy()
    off[0, 7, 1] += 2e-3
    one, other = summed(), summed(off)
    quick = certify([one], [other], np.arange(120))
    slow = certify([replace(one, linear_morph=lambda frames: None)], [other], np.arange(120))
    np.testing.assert_allclose(quick.vertex_largest, slow.vertex_largest, rtol=1e-3)
    np.testing.assert_allclose(quick.vertex_mean, slow.vertex_mean, rtol=1e-3)
    np.testing.assert_allclose(slow.vertex_largest, 2e-3 * one.weights[:, 0].max(), rtol=1e-3)


def test_sums_that_are_not_what_is_shown_count_for_nothing() -> None:
    """A program whose frames are no sums (here: off by 1 m) is asked for every frame."""
    one, other = summed(), summed()
    bent = replace(other, points_at=lambda frames: one.points_at(frames) + 1)
    np.testing.assert_allclose(
        certify([one], [bent], np.arange(120)).vertex_mean, np.sqrt(3), rtol=0.5
    )
    assert certify([bent], [bent], np.arange(120)).vertex_largest == 0


def test_the_rounding_of_many_shapes_is_no_other_motion() -> None:
    """UsdSkel adds 800 shapes one after the other, in 32 bits; on a rig they were off by 1.1e-6."""
    one = summed(np.tile(MOVES[:1] / 800, (800, 1, 1)))
    asked = []

    def points_at(frames: np.ndarray) -> np.ndarray:
        asked.extend(frames)
        return one.points_at(frames) * (1 + 1.2e-6)

    shown = replace(one, points_at=points_at)
    assert certify([one], [shown], np.arange(120)).vertex_largest < 1e-5
    assert len(asked) < 120  # a few frames, not each


def test_rounding_of_whole_numbers_is_no_loss_and_more_is() -> None:
    """Two shapes at known weights, on a mesh that is shown at half its size."""
    halves = HalfSteps(1e-3, 1e-3, np.array([2e-3, 0]), np.array([0, 2e-3]))
    lengths = np.full((8, 30), 0.5)
    steps = StoredSteps(halves, WEIGHTS, np.full((8, 2), (0.5, 2.0)), lambda f: lengths[f])
    most = np.sqrt(3) * 0.5 * (1e-3 + 2e-3 * WEIGHTS[:, 0])
    np.testing.assert_allclose(steps.of_points(FRAMES), most)
    turned = np.degrees(np.arcsin(np.sqrt(3) * 2 * (1e-3 + 2e-3 * WEIGHTS[:, 1]) / 0.5))
    np.testing.assert_allclose(steps.of_angles(FRAMES), np.tile(turned[:, None], 30))
    for share, lost in ((0.99, False), (1.05, True)):
        off = ANIMATED.copy()
        off[:, 7, 1] += share * most
        certificate = certify([mesh(ANIMATED)], [mesh(off, steps=steps)], FRAMES)
        assert bool(certificate.findings("x")) == lost
        np.testing.assert_allclose(certificate.vertex_largest, share * most.max(), rtol=1e-9)
        assert certificate.vertex_rounding == most.max()
        angle = np.radians(turned.min() + (0.6 if lost else 0.4))
        certificate = certify([mesh(ANIMATED)], [mesh(ANIMATED, angle, steps=steps)], FRAMES)
        assert bool(certificate.findings("x")) == lost
    # A source that is stored so is exact: what it says is what it is.
    assert certify([mesh(ANIMATED, steps=steps)], [mesh(off)], FRAMES).findings("x")
