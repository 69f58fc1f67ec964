from dataclasses import replace

import numpy as np
import pytest
from slits import slit_face

from usdface.face.head_size import moved_size, report_size, size_by_eyes
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.rigs import BlendShape, Mesh, Rig


def face(scale: float) -> Rig:
    """A sheet 0.2 m wide whose shapes move patches of 0.1 m."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 21), np.linspace(-0.1, 0.1, 21))
    points = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    shapes = []
    for k, centre in enumerate(((-0.05, 0), (0.05, 0), (0, 0.05))):
        near = np.flatnonzero(np.abs(points[:, :2] - centre).max(axis=1) < 0.036)
        offsets = np.full((len(near), 3), 0.01 * scale)
        far = BlendShape(f"s{k}", [*near, 440] if near[-1] < 440 else near, [*offsets, [1e-5] * 3])
        shapes.append(far)
    mesh = Mesh("Face", scale * points, [3], [0, 1, 2], shapes=tuple(shapes))
    return Rig("r", (mesh,))


def test_the_size_is_that_of_what_moves() -> None:
    assert moved_size(face(1.0)) == pytest.approx(0.0849, abs=0.02)
    bare = replace(face(1.0).meshes[0], shapes=())
    assert moved_size(Rig("r", (bare,))) == 0.0 and report_size(Rig("r", (bare,))) == []


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.5])
def test_small_and_large_heads_pass(scale: float) -> None:
    assert report_size(face(scale)) == []


@pytest.mark.parametrize("scale", [0.001, 0.01, 0.1, 10.0, 100.0, 1000.0])
def test_a_wrong_unit_is_said(scale: float) -> None:
    (found,) = report_size(face(scale))
    assert found.code == "RIG_SIZE_UNUSUAL" and found.severity == "warning"
    assert "is the unit of length right?" in found.message


@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_the_eyes_tell_the_size_of_a_face(scale: float) -> None:
    points, lids = slit_face().points, find_lip_lid_contacts(slit_face()).lids
    assert size_by_eyes(scale * points, lids) == pytest.approx(scale * 0.07 / 0.063)


def test_one_eye_tells_no_size() -> None:
    points, lids = slit_face().points, find_lip_lid_contacts(slit_face()).lids
    left = lids[points[lids[:, 0], 0] > 0]
    assert 0 < len(left) < len(lids)
    assert np.isnan(size_by_eyes(points, left)) and np.isnan(size_by_eyes(points, lids[:0]))
