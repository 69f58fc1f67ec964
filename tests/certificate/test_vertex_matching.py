import numpy as np

from usdface.certificate.vertex_matching import VertexTraits, match_vertices

RNG = np.random.default_rng(5)
PLACES = RNG.normal(size=(400, 6))
NORMALS = RNG.normal(size=(400, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)


def pairs(one: VertexTraits, other: VertexTraits) -> set[tuple[int, int]]:
    return set(zip(*(side.tolist() for side in match_vertices(one, other)), strict=True))


def test_an_order_is_found_again() -> None:
    order = RNG.permutation(400)
    expected = {(int(k), n) for n, k in enumerate(order)}
    for noise in (0, 1e-7, 1e-3):  # equal, as numbers of 32 bits, and far beyond that
        places = PLACES[order] + noise * RNG.normal(size=(400, 6))
        for shown in (None, NORMALS):
            one = VertexTraits(PLACES, shown)
            other = VertexTraits(places, None if shown is None else shown[order])
            assert pairs(one, other) == expected


def test_what_was_split_has_partners_and_what_was_joined_too() -> None:
    twice = np.r_[np.arange(400), np.arange(50)]
    expected = {(int(k), n) for n, k in enumerate(twice)}
    found = pairs(VertexTraits(PLACES), VertexTraits(PLACES[twice]))
    assert found <= expected and {n for _, n in found} == set(range(450))


def test_normals_decide_between_points_that_rounding_brought_together() -> None:
    """Pairs of points 1e-9 apart, back to back, were rounded by 1e-5 of the size."""
    places = np.concatenate([PLACES, PLACES + 1e-9])
    normals = np.concatenate([NORMALS, -NORMALS])
    rounded = places + 1e-6 * RNG.normal(size=places.shape)
    assert pairs(VertexTraits(places, normals), VertexTraits(rounded, normals)) == {
        (k, k) for k in range(800)
    }


def test_normals_decide_among_many_points_that_are_rounded_far() -> None:
    """Twelve at each of 30 places, each in a direction of its own, as at the pole of a sphere."""
    places = np.repeat(PLACES[:30], 12, axis=0)
    size = np.ptp(PLACES[:, :3], axis=0).max()
    noise = 3e-4 * size * RNG.uniform(-1, 1, places.shape)
    one = VertexTraits(places, NORMALS[:360])
    other = VertexTraits(places + noise, NORMALS[:360])
    expected = [(k, k) for k in range(360)]
    found = match_vertices(one, other, rounding=float(np.linalg.norm(noise, axis=1).max()))
    assert list(zip(*(side.tolist() for side in found), strict=True)) == expected
    unknown = match_vertices(one, other)
    assert len(unknown[0]) != 360  # without the rounding neighbours are taken for each other


def test_normals_decide_among_many_points_that_are_off_alike() -> None:
    """Twelve at each of 30 places, as at the pole of a sphere, whose joint is off by 3e-4."""
    places = np.repeat(PLACES[:30], 12, axis=0)
    off = np.repeat(3e-4 * RNG.normal(size=(30, 6)), 12, axis=0)
    one, other = VertexTraits(places, NORMALS[:360]), VertexTraits(places + off, NORMALS[:360])
    assert pairs(one, other) == {(k, k) for k in range(360)}


def test_wrong_normals_do_not_part_what_stands_in_one_place() -> None:
    found = pairs(VertexTraits(PLACES, NORMALS), VertexTraits(PLACES, -NORMALS))
    assert found == {(k, k) for k in range(400)}


def test_one_vertex_has_one_partner() -> None:
    one = VertexTraits(PLACES[:1], NORMALS[:1])
    assert pairs(one, one) == pairs(one, VertexTraits(PLACES[:1] + 1, NORMALS[:1])) == {(0, 0)}
