"""Vertices that joints move: all frames at once are what each vertex and frame shows."""

from dataclasses import replace

import numpy as np
import pytest
from dense_offsets import dense_offsets
from scipy.spatial.transform import Rotation

from usdface.certificate import linear_morph, vertex_transforms
from usdface.certificate.linear_morph import LinearMorph, normal_distances, point_distances
from usdface.certificate.vertex_transforms import VertexTransforms

RNG = np.random.default_rng(11)
FRAMES = np.array([0, 2, 3, 4])
JOINTS, HELD = 5, 3


def rotations(frames: int, joints: int) -> np.ndarray:
    return (
        Rotation.random(frames * joints, random_state=7).as_matrix().reshape(frames, joints, 3, 3)
    )


def skinned(count: int, groups: int) -> tuple[VertexTransforms, np.ndarray, np.ndarray]:
    """Joints that turn, scale and move; weights that need not add up to 1."""
    turns = rotations(6, JOINTS) * RNG.uniform(0.5, 2, size=(6, JOINTS, 1, 1))
    transforms = np.concatenate([turns, RNG.normal(size=(6, JOINTS, 3, 1))], -1)
    joints = RNG.integers(JOINTS, size=(groups, HELD))
    weights = RNG.uniform(size=(groups, HELD))
    chosen = RNG.integers(groups, size=count)
    motion = VertexTransforms.of(transforms, turns, joints[chosen], weights[chosen])
    assert motion is not None
    return motion, joints[chosen], weights[chosen]


def morph(count: int, motion: VertexTransforms | None) -> LinearMorph:
    moves, turns = RNG.normal(size=(2, 4, count, 3)).astype(np.float32)
    moves[:, ::3] = turns[:, ::3] = 0  # vertices that no shape moves
    rest, normals = RNG.normal(size=(2, count, 3))
    offsets, turned = map(dense_offsets, (moves, turns))
    return LinearMorph(RNG.normal(size=(6, 4)), rest, offsets, normals, turned, motion)


def test_a_vertex_goes_where_its_joints_take_it() -> None:
    motion, joints, weights = skinned(9, 9)
    shown = motion.of_points(FRAMES, motion.groups)
    for vertex in range(9):
        for row, frame in enumerate(FRAMES):
            expected = sum(
                w * motion.transforms[frame, j]
                for j, w in zip(joints[vertex], weights[vertex], strict=True)
            )
            np.testing.assert_allclose(shown[row, vertex], expected, atol=1e-12)


def test_vertices_with_the_same_joints_are_one_group() -> None:
    motion, joints, weights = skinned(500, 7)
    assert len(motion.weights) == len(np.unique(np.concatenate([joints, weights], 1), axis=0)) <= 7
    turns = rotations(6, 1)[:, 0]
    moved = VertexTransforms.rigid(np.concatenate([turns, np.ones((6, 3, 1))], -1), turns, 5)
    np.testing.assert_allclose(
        moved.of_points(FRAMES, np.zeros(1, int))[:, 0, :, :3], turns[FRAMES]
    )


def test_too_many_groups_are_not_held(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vertex_transforms, "_MOST", 3)
    transforms = np.zeros((1, 4, 3, 4))
    one = VertexTransforms.of(
        transforms, transforms[..., :3], np.zeros((2, 1), int), np.ones((2, 1))
    )
    assert one is None


@pytest.mark.parametrize("groups", [1, 3, 400])
@pytest.mark.parametrize("still", ["none", "one", "other"])
def test_all_frames_at_once_are_what_each_frame_shows(
    groups: int, still: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linear_morph, "_BLOCK", 3000)  # several blocks
    one = morph(400, None if still == "one" else skinned(400, groups)[0])
    other = morph(400, None if still == "other" else skinned(400, groups)[0])
    pairs = RNG.permutation(400), RNG.permutation(400)
    apart = np.concatenate(list(point_distances(one, other, pairs, FRAMES)), 1)
    turned = np.concatenate([t for t, _ in normal_distances(one, other, pairs, FRAMES)], 1)
    assert apart.shape == turned.shape == (len(FRAMES), 400)
    for row, frame in enumerate(FRAMES):
        gap = one.points_at(frame)[pairs[0]] - other.points_at(frame)[pairs[1]]
        expected = np.sort(np.linalg.norm(gap, axis=1))
        np.testing.assert_allclose(np.sort(apart[row]), expected, rtol=1e-4, atol=1e-5)
        mine, its = one.normals_at(frame), other.normals_at(frame)
        assert mine is not None and its is not None
        chord = np.sort(np.linalg.norm(mine[pairs[0]] - its[pairs[1]], axis=1))
        np.testing.assert_allclose(np.sort(turned[row]), chord, rtol=1e-3, atol=1e-5)


def test_what_moves_alike_is_alike_far_from_the_origin() -> None:
    """A head 100 m away, off by a micrometre: differences come before sums of 32 bits."""
    motion, _, _ = skinned(50, 1)
    motion.transforms[..., 3] += 100
    one = replace(morph(50, motion), weights=np.zeros((6, 4)))
    moved = one.points + np.array([1e-6, 0, 0])
    other = LinearMorph(one.weights, moved, one.moves, motion=motion)
    same = np.arange(50), np.arange(50)
    (apart,) = point_distances(one, other, same, FRAMES)
    matrix = motion.of_points(FRAMES, np.zeros(1, int))[..., :3, 0]
    expected = 1e-6 * np.linalg.norm(matrix, axis=-1)
    np.testing.assert_allclose(apart, np.broadcast_to(expected, apart.shape), rtol=1e-3)


def test_mixtures_by_one_transform_are_sums_of_frames() -> None:
    one, shares = morph(30, skinned(30, 1)[0]), RNG.normal(size=(2, 6))
    mixed = one.mixed(shares)
    assert mixed is not None
    expected = np.einsum("kf,fnd->knd", shares, [one.points_at(f) for f in range(6)])
    np.testing.assert_allclose(mixed, expected, atol=1e-4)
    assert morph(30, skinned(30, 9)[0]).mixed(shares) is None
