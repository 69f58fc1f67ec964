import numpy as np
import pytest
import trimesh

from usdface.geometry.signed_volume import signed_volume

# A unit cube, of quads that look outwards.
POINTS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
FOUR = np.full(6, 4)


def test_a_cube_has_its_volume_wherever_it_is() -> None:
    for away in (0.0, 7.0):
        assert signed_volume(2.0 * POINTS + away, FOUR, QUADS.ravel()) == pytest.approx(8.0)


def test_inside_out_it_is_negative_and_open_it_keeps_its_sign() -> None:
    assert signed_volume(POINTS, FOUR, QUADS[:, ::-1].ravel()) == pytest.approx(-1.0)
    for k in range(6):
        some = np.delete(QUADS, k, axis=0)
        assert signed_volume(POINTS, FOUR[:5], some.ravel()) > 0.0
        assert signed_volume(POINTS, FOUR[:5], some[:, ::-1].ravel()) < 0.0


def test_trimesh_finds_the_same_of_triangles_pentagons_and_edges() -> None:
    sphere = trimesh.creation.icosphere(2)
    triangles = np.asarray(sphere.faces)
    counts = np.full(len(triangles), 3)
    assert signed_volume(np.asarray(sphere.vertices), counts, triangles.ravel()) == pytest.approx(
        sphere.volume
    )
    angles = np.arange(5) * 2 * np.pi / 5
    ring = np.stack([np.cos(angles), np.zeros(5), np.sin(angles)], axis=1)
    above = np.array([0.0, 2.0, 0.0])
    points = np.concatenate([ring, ring + above])
    sides = [[k, k + 5, (k + 1) % 5 + 5, (k + 1) % 5] for k in range(5)]
    flat = [*range(5), *range(9, 4, -1), *np.ravel(sides), 0, 1]  # and an edge
    mixed = np.array([5, 5, 4, 4, 4, 4, 4, 2])
    expected = 2.0 * 2.5 * np.sin(2 * np.pi / 5)
    assert signed_volume(points, mixed, np.array(flat)) == pytest.approx(expected)
