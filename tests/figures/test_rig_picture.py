import numpy as np
from slits import slit_face

from usdface.figures import rig_picture
from usdface.figures.rig_picture import face_view, rig_pictures
from usdface.rigs import Rig

RIG = Rig("face", (slit_face(),))
NAMES = RIG.shape_names
VIEW = face_view(RIG, (60, 60))


def blinking(*weights: float) -> np.ndarray:
    closes = np.array([name.startswith("eyeBlink") for name in NAMES])
    return np.array(weights)[:, None] * closes


def test_a_picture_is_the_same_whatever_is_drawn_before_it() -> None:
    """Lids that a picture of open eyes holds in shadow are lit where they are closed."""
    alone = rig_pictures(RIG, NAMES, blinking(1.0), VIEW)[0]
    opened, closed = rig_pictures(RIG, NAMES, blinking(0.0, 1.0), VIEW)
    np.testing.assert_array_equal(closed, alone)
    assert (opened != closed).any()


def test_pictures_of_nearly_the_same_face_share_their_occlusion(monkeypatch) -> None:
    drawn = []

    def counted(points, triangles):
        drawn.append(points)
        return np.ones(len(points))

    monkeypatch.setattr(rig_picture, "openness", counted)
    rig_pictures(RIG, NAMES, blinking(0.0, 1.0, 0.01, 1.0, 0.99), VIEW)
    assert len(drawn) == 2
