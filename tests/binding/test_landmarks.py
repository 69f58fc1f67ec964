from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh, landmarks
from worlds import make_world

from usdface.binding.face_surface import face_surface
from usdface.binding.landmarks import FaceLandmarks, find_landmarks
from usdface.face.marker_name_places import LANDMARKS
from usdface.io.usd.rig import read_rig

HEAD = Path(__file__).resolve().parents[2] / "examples" / "head.usdc"


@pytest.fixture(scope="module")
def example() -> FaceLandmarks:
    found = find_landmarks(face_surface(read_rig(HEAD)[0].face()))
    assert found is not None
    return found


def at(found: FaceLandmarks, name: str, side: int = 1) -> np.ndarray:
    place = np.multiply(LANDMARKS[name], (side, 1))
    return found.points[np.abs(found.average - place).max(axis=1).argmin()]


def test_landmarks_of_a_symmetric_head_are_symmetric(example: FaceLandmarks) -> None:
    for name, (x, _) in LANDMARKS.items():
        if x:
            np.testing.assert_allclose(
                at(example, name, 1) * [-1, 1, 1], at(example, name, -1), atol=1e-5
            )


def test_landmarks_are_in_the_order_of_a_face(example: FaceLandmarks) -> None:
    down = ("brow", "lid upper", "lid lower", "nose tip", "nose base", "mouth corner", "menton")
    assert (np.diff([at(example, name)[1] for name in down]) < 0).all()
    assert at(example, "nose tip")[2] == example.surface.points[:, 2].max()
    assert at(example, "eye inner")[0] < at(example, "eye outer")[0]


def test_landmarks_are_carried_to_themselves(example: FaceLandmarks) -> None:
    found = example.surface.points[example.vertices_at(example.average)]
    assert np.linalg.norm((found - example.points)[:, :2], axis=1).max() < 0.006


def test_landmarks_follow_the_size_of_the_head(example: FaceLandmarks) -> None:
    mesh = example.surface.mesh
    shapes = tuple(replace(s, offsets=2 * s.offsets) for s in mesh.shapes)
    found = find_landmarks(face_surface(replace(mesh, points=2 * mesh.points, shapes=shapes)))
    assert found is not None
    np.testing.assert_allclose(found.points, 2 * example.points, atol=1e-9)
    assert found.unit == pytest.approx(2 * example.unit)


@pytest.mark.parametrize("weight", [0.15, 0.3])
def test_a_mouth_that_rests_open_hides_no_landmark(example: FaceLandmarks, weight: float) -> None:
    mesh = example.surface.mesh
    jaw = next(shape for shape in mesh.shapes if shape.name == "jawOpen")
    points = mesh.points.copy()
    points[jaw.indices] += weight * jaw.offsets
    rest = replace(jaw, offsets=(1 - weight) * jaw.offsets, normal_offsets=None)
    shapes = tuple(rest if shape is jaw else shape for shape in mesh.shapes)
    found = find_landmarks(face_surface(replace(mesh, points=points, shapes=shapes)))
    assert found is not None
    np.testing.assert_array_equal(found.average, example.average)
    away = np.linalg.norm(found.points - example.points, axis=1)
    lower = np.isin(example.average[:, 1], [LANDMARKS[k][1] for k in ("mouth corner", "menton")])
    assert away[~lower].max() < 1e-6 and away.max() < 0.007


def test_a_face_without_lips_or_lids_reveals_none() -> None:
    assert find_landmarks(face_surface(make_world().rig.face())) is None


@pytest.mark.slow
def test_landmarks_are_those_of_the_ict_model(shared_data: Path) -> None:
    mesh = ict_mesh(shared_data)
    found = find_landmarks(face_surface(mesh))
    assert found is not None
    published = mesh.points[landmarks(shared_data)]
    for name, index in (
        *(("eye inner", 42), ("eye outer", 45), ("nose tip", 30), ("nose base", 33)),
        *(("mouth corner", 64),),
    ):
        assert np.linalg.norm((at(found, name) - published[index])[:2]) < 0.004
