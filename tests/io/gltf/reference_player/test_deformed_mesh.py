from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from usdface.io.gltf.reference_player.deformed_mesh import PlayerMesh, Sampled
from usdface.io.gltf.reference_player.morph_targets import PlayerTargets
from usdface.io.gltf.reference_player.node_motion import Space

RNG = np.random.default_rng(9)
TIMES = np.array([0.5, 1.0, 3.0])


def shown(weights: np.ndarray, interpolation: str, **more: object) -> PlayerMesh:
    count = weights.shape[-1]
    points = RNG.normal(size=(4, 3))
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    moves, turns = RNG.normal(size=(2, count, 4, 3)).astype(np.float32)
    given = {"inbetweens": (), "space": Space(lambda times: (np.eye(4), np.eye(3)))} | more
    names = tuple(f"t{k}" for k in range(count))
    return PlayerMesh(
        "m",
        names,
        points,
        normals,
        PlayerTargets.of(moves),
        PlayerTargets.of(turns),
        Sampled(TIMES, weights, interpolation),
        **given,  # type: ignore[arg-type]
    )


def test_cubic_weights_are_hermite_splines() -> None:
    keys = RNG.normal(size=(3, 3, 2))
    keys[:, 2] = keys[:, 0]  # equal tangents on both sides
    mesh = shown(keys, "CUBICSPLINE")
    moments = np.linspace(0.5, 3, 41)
    spline = CubicHermiteSpline(TIMES, keys[:, 1], keys[:, 0])
    np.testing.assert_allclose(mesh.weights_at(moments), spline(moments), atol=1e-12)
    ends = mesh.weights_at(np.array([-1.0, 9.0]))
    np.testing.assert_allclose(ends, keys[[0, -1], 1], atol=1e-12)


def test_inbetweens_are_parts_of_their_shape() -> None:
    weights = RNG.normal(size=(3, 3))
    names, channels = shown(weights, "LINEAR", inbetweens=((1, 2, 0.25),)).channels_at(TIMES)
    assert names == ("t0", "t2")
    expected = np.stack([weights[:, 0], weights[:, 2] + 0.25 * weights[:, 1]], 1)
    np.testing.assert_allclose(channels, expected)


def test_matrices_for_all_or_for_each_vertex_and_time() -> None:
    matrix = np.eye(4)
    matrix[:3] = RNG.normal(size=(3, 4))
    turning = np.linalg.inv(matrix[:3, :3]).T
    weights = RNG.normal(size=(3, 2))
    one = shown(weights, "LINEAR", space=Space(lambda times: (matrix, turning)))
    normals = one.normals_at(TIMES)
    assert normals is not None
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1)
    for shape in ((4, 1, 1), (3, 1, 1, 1), (3, 4, 1, 1)):
        each = np.tile(matrix, shape), np.tile(turning, shape)
        other = replace(one, space=Space(lambda times, each=each: each))
        np.testing.assert_allclose(one.points_at(TIMES), other.points_at(TIMES), atol=1e-12)
        theirs = other.normals_at(TIMES)
        assert theirs is not None
        np.testing.assert_allclose(normals, theirs, atol=1e-12)
