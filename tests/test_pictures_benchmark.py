"""Materials of the ICT face, as the benchmark of pictures gives them."""

from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh

from usdface.figures.rig_picture import face_view, rig_pictures, rig_triangles
from usdface.rigs import Rig

CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture
def dressed(shared_data: Path, monkeypatch: pytest.MonkeyPatch) -> Rig:
    """Return the ICT face with materials, as `python -m benchmarks.pictures` draws it."""
    monkeypatch.syspath_prepend(str(CHECKOUT))
    from benchmarks.pictures.ict_materials import with_ict_materials

    return with_ict_materials(Rig("Face", (ict_mesh(shared_data),)))


def test_lashes_and_tear_film_are_not_drawn(dressed: Rig) -> None:
    (mesh,) = dressed.meshes
    shown = rig_triangles(dressed, (), np.zeros((1, 0)))
    every = np.concatenate([subset.faces for subset in mesh.subsets])
    assert len(np.unique(every)) == len(every) < len(mesh.face_counts)  # the others are skin
    assert shown.triangles.max() == 24590  # the last vertex of the eyeballs


@pytest.mark.slow
def test_eyes_are_seen_while_they_are_open(dressed: Rig) -> None:
    names = ("eyeBlink_L", "eyeBlink_R")
    view = face_view(dressed, (250, 280))
    opened, closed = rig_pictures(dressed, names, np.array([[0.0, 0.0], [1.0, 1.0]]), view)

    def bluish(picture: np.ndarray) -> int:
        red, _, blue = np.moveaxis(picture[60:150].astype(int), -1, 0)  # about the eyes
        return int(((blue > red + 15) & (red < 150)).sum())

    assert bluish(opened) > 100 > 10 * bluish(closed)
