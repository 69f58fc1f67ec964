import numpy as np
from dense_offsets import dense_offsets

from usdface.certificate.linear_morph import LinearMorph, normal_distances, point_distances
from usdface.certificate.vertex_offsets import VertexOffsets

RNG = np.random.default_rng(9)
FRAMES = np.array([1, 4, 5])
NOTHING = dense_offsets(np.zeros((0, 2, 3)))


def sums(count: int, parts: int) -> LinearMorph:
    moves = [dense_offsets(m) for m in RNG.normal(size=(2, parts, count, 3))]
    return LinearMorph(
        RNG.normal(size=(6, parts)), *(f(count, m) for m in moves for f in (still, kept))
    )


def still(count: int, _: VertexOffsets) -> np.ndarray:
    return RNG.normal(size=(count, 3))


def kept(_: int, moves: VertexOffsets) -> VertexOffsets:
    return moves


def test_blocks_are_what_each_frame_shows() -> None:
    one, other = sums(7, 3), sums(5, 2)
    pairs = np.array([0, 6, 3, 3]), np.array([4, 0, 2, 1])
    apart = np.concatenate(list(point_distances(one, other, pairs, FRAMES)), 1)
    turned = np.concatenate([t for t, _ in normal_distances(one, other, pairs, FRAMES)], 1)
    for row, frame in enumerate(FRAMES):
        gap = one.points_at(frame)[pairs[0]] - other.points_at(frame)[pairs[1]]
        length = np.linalg.norm(gap, axis=1)
        np.testing.assert_allclose(np.sort(apart[row]), np.sort(length), rtol=1e-5)
        mine, its = one.normals_at(frame), other.normals_at(frame)
        assert mine is not None and its is not None
        chord = np.linalg.norm(mine[pairs[0]] - its[pairs[1]], axis=1)
        np.testing.assert_allclose(np.sort(turned[row]), np.sort(chord), rtol=1e-4)


def test_equal_meshes_are_equal_to_the_last_bit_of_32() -> None:
    one = sums(50, 4)
    same = np.arange(50), np.arange(50)
    assert max(block.max() for block in point_distances(one, one, same, FRAMES)) < 1e-6
    assert max(block.max() for block, _ in normal_distances(one, one, same, FRAMES)) < 1e-6


def test_without_normals_there_are_no_turns() -> None:
    bare = LinearMorph(np.zeros((6, 0)), np.zeros((2, 3)), NOTHING)
    assert bare.normals_at(0) is None
    assert list(normal_distances(bare, sums(2, 1), (np.arange(2), np.arange(2)), FRAMES)) == []


def test_a_mesh_without_parts_stands_still() -> None:
    still = LinearMorph(np.zeros((6, 0)), np.ones((2, 3)), NOTHING)
    moved = LinearMorph(np.zeros((6, 0)), np.zeros((2, 3)), NOTHING)
    (apart,) = point_distances(still, moved, (np.arange(2), np.arange(2)), FRAMES)
    np.testing.assert_allclose(apart, np.sqrt(3), rtol=1e-6)


def test_pairs_that_nothing_moves_have_one_row() -> None:
    moves = np.zeros((1, 4, 3))
    moves[0, 2:] = 1.0
    offsets = dense_offsets(moves)
    normals = RNG.normal(size=(4, 3))
    weights = np.linspace(0, 1, 6)[:, None]
    one = LinearMorph(weights, np.zeros((4, 3)), offsets, normals, offsets)
    other = LinearMorph(weights, np.ones((4, 3)), offsets, normals, offsets)
    pairs = np.arange(4), np.arange(4)
    for part in (slice(0, 2), slice(2, 4)):
        some = pairs[0][part], pairs[1][part]
        rows = 1 if part.start == 0 else len(FRAMES)
        (apart,) = point_distances(one, other, some, FRAMES)
        ((turned, lengths),) = normal_distances(one, other, some, FRAMES)
        assert apart.shape == turned.shape == lengths.shape == (rows, 2)
        np.testing.assert_allclose(apart, np.sqrt(3), rtol=1e-6)


def test_mixtures_are_sums_of_frames() -> None:
    one = sums(7, 3)
    shares = RNG.normal(size=(2, 6))
    expected = np.einsum("kf,fnd->knd", shares, [one.points_at(f) for f in range(6)])
    np.testing.assert_allclose(one.mixed(shares), expected, atol=1e-5)
