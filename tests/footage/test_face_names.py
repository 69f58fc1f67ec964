import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface import read_rig
from usdface.arrays import FloatArray
from usdface.footage.face_names import pair_with_face

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def bound_points() -> FloatArray:
    """The 42 bound vertices of the example's head (M, 3) [m]."""
    bound = json.loads((EXAMPLES / "bind.json").read_text())["markers"]
    mesh = read_rig(EXAMPLES / "head.usdc")[0].mesh("head")
    return np.array(mesh.points)[[each["point"] for each in bound.values()]]


@pytest.fixture(scope="module")
def points() -> FloatArray:
    return bound_points()


def performer(points: FloatArray, seed: int, own: float = 0.03) -> FloatArray:
    """Another person's face: other proportions, smoothly bent, dots painted a little beside."""
    random = np.random.default_rng(seed)
    size = float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))
    apart = ((points[:, None] - points) ** 2).sum(axis=2)
    bends = (0.055 * size) ** 2 * np.exp(-0.5 * apart / (0.7 * size) ** 2)
    bends += (own * size) ** 2 * np.eye(len(points))
    bent = np.linalg.cholesky(bends) @ random.standard_normal(points.shape)
    return points * (1 + random.normal(0, 0.06, 3)) + bent


def filmed(points: FloatArray, angles: tuple[float, float, float]) -> FloatArray:
    """Pixels, y down, of a head half a metre before the camera."""
    turned = points @ Rotation.from_euler("YXZ", angles, degrees=True).as_matrix().T
    return 1500 * turned[:, :2] / (0.5 - turned[:, 2:]) * (1, -1) + (640, 480)


@pytest.mark.parametrize("angles", [(0, 0, 0), (20, 10, -10), (-20, -15, 15)])
def test_the_characters_own_dots_get_the_names_of_its_vertices(
    points: FloatArray, angles: tuple[float, float, float]
) -> None:
    order = np.random.default_rng(0).permutation(len(points))
    pairs = pair_with_face(filmed(points, angles)[order], points)
    named = pairs >= 0
    assert np.array_equal(order[pairs[named]], np.flatnonzero(named))
    assert named.sum() >= len(points) - 1


@pytest.mark.slow
def test_another_persons_dots_get_them_too_where_some_are_hidden(points: FloatArray) -> None:
    right = wrong = shown = 0
    for seed in range(8):
        random = np.random.default_rng(100 + seed)
        angles = tuple(random.normal(0, [12, 10, 8]))
        seen = random.permutation(len(points))[: len(points) - int(random.integers(0, 6))]
        pairs = pair_with_face(filmed(performer(points, seed), angles)[seen], points)
        named = pairs >= 0
        own = seen[pairs[named]] == np.flatnonzero(named)
        right, wrong, shown = right + own.sum(), wrong + (~own).sum(), shown + len(seen)
    assert right > 0.9 * shown and wrong < 0.02 * shown


def test_a_speck_beside_the_face_gets_no_name(points: FloatArray) -> None:
    image = filmed(points, (5, 5, 0))
    speck = image.min(axis=0) - 60
    pairs = pair_with_face(np.vstack([speck, image]), points)
    assert np.array_equal(pairs, np.arange(len(points)) + 1)


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few_dots_get_no_names(points: FloatArray, count: int) -> None:
    pairs = pair_with_face(filmed(points, (0, 0, 0))[:count], points)
    assert (pairs == -1).all()
    assert (pair_with_face(np.zeros((5, 2)), points) == -1).all()
