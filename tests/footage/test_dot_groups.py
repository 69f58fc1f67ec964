import numpy as np
import pytest
from painted import layout

from usdface.footage.dot_groups import dots_far_apart

FACE = layout()
EXTENT = float(np.ptp(FACE, axis=0).max())
SPECKS = np.array([[2000.0, 40.0], [10.0, 3000.0]])


@pytest.mark.parametrize("specks", [0, 1, 2])
def test_two_faces_in_one_image_are_two_groups(specks: int) -> None:
    other = 0.8 * FACE[:12] + [3.0 * EXTENT, 20.0]
    places = np.concatenate([SPECKS[:specks], FACE, other])
    places[specks] = np.nan
    found = dots_far_apart(places)
    assert found is not None
    larger, smaller, gap = found
    assert larger.tolist() == list(range(specks + 1, specks + 20))
    assert smaller.tolist() == list(range(specks + 20, specks + 32))
    assert EXTENT < gap < 3.0 * EXTENT


def test_dots_of_brows_and_mouth_alone_are_one_face() -> None:
    brows = np.stack([np.linspace(0.0, 120.0, 8), np.zeros(8)], axis=1)
    mouth = np.stack([np.linspace(35.0, 85.0, 8), np.full(8, 85.0)], axis=1)
    assert dots_far_apart(np.concatenate([brows, mouth])) is None


def test_specks_beside_a_face_are_no_face() -> None:
    assert dots_far_apart(np.concatenate([FACE, SPECKS])) is None
    assert dots_far_apart(FACE[:3]) is None and dots_far_apart(np.full((20, 2), np.nan)) is None


def test_dots_at_one_place_are_one_group() -> None:
    assert dots_far_apart(np.ones((20, 2))) is None
