"""Numbered landmarks of face trackers, and their places on an average face.

Trackers name their landmarks by number: OpenFace and dlib the 68 of iBUG's annotations (C. Sagonas
et al., "300 Faces In-The-Wild Challenge", 2016), MediaPipe those of its face mesh. Left is the
performer's, as everywhere.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["LandmarkPlace", "landmark_places", "nose_tip_landmark"]


@dataclass(frozen=True, slots=True)
class LandmarkPlace:
    """The place of a landmark on the average face.

    Attributes
    ----------
    part : str
        One of `usdface.face.place_vocabulary.PARTS`.
    x, y : float [mm]
        x to the performer's left, y up from the line of the eyes.
    spread : float [mm]
        Standard deviation between faces.
    """

    part: str
    x: float
    y: float
    spread: float


# Of the left half and the midline, by iBUG's numbers. Corners, lids, nose, mouth and chin are those
# of `usdface.face.marker_name_places.LANDMARKS`; the rest follows iBUG's order along brows, lips
# and jaw. Spreads were set by hand: a jaw line is where a tracker sees the outline of the face.
# Beside the ears (0 to 2, 14 to 16) that outline is no place on the skin. Inner lips are as far
# apart as those of MediaPipe's canonical face model: closed ones would be told apart by nothing
# else.
_LEFT: Mapping[int, LandmarkPlace] = MappingProxyType(
    {
        8: LandmarkPlace("chin", 0, -116, 8),
        9: LandmarkPlace("chin", 20, -113, 12),
        10: LandmarkPlace("jaw", 37, -105, 14),
        11: LandmarkPlace("jaw", 51, -92, 14),
        12: LandmarkPlace("jaw", 61, -75, 14),
        13: LandmarkPlace("jaw", 68, -56, 14),
        22: LandmarkPlace("brow", 14, 21, 7),
        23: LandmarkPlace("brow", 26, 25, 7),
        24: LandmarkPlace("brow", 37, 26, 7),
        25: LandmarkPlace("brow", 47, 23, 7),
        26: LandmarkPlace("brow", 55, 16, 7),
        27: LandmarkPlace("nose", 0, 0, 6),
        28: LandmarkPlace("nose", 0, -11, 6),
        29: LandmarkPlace("nose", 0, -23, 6),
        30: LandmarkPlace("nose", 0, -35, 5),
        33: LandmarkPlace("nose", 0, -47, 4),
        34: LandmarkPlace("nose", 7, -46, 4),
        35: LandmarkPlace("nostril", 14, -43, 5),
        42: LandmarkPlace("eye", 16.5, 0, 4),
        43: LandmarkPlace("lid", 26, 5, 4),
        44: LandmarkPlace("lid", 36, 5, 4),
        45: LandmarkPlace("eye", 46, 0, 4),
        46: LandmarkPlace("lid", 36, -5, 4),
        47: LandmarkPlace("lid", 26, -5, 4),
        51: LandmarkPlace("lip", 0, -60, 4),
        52: LandmarkPlace("lip", 6, -59, 4),
        53: LandmarkPlace("lip", 15, -62, 4),
        54: LandmarkPlace("mouth", 25, -68, 4),
        55: LandmarkPlace("lip", 16, -76, 4),
        56: LandmarkPlace("lip", 7, -79, 4),
        57: LandmarkPlace("lip", 0, -80, 4),
        62: LandmarkPlace("lip", 0, -66, 4),
        63: LandmarkPlace("lip", 7, -66, 4),
        64: LandmarkPlace("mouth", 22, -68, 4),
        65: LandmarkPlace("lip", 7, -71, 4),
        66: LandmarkPlace("lip", 0, -71, 4),
    }
)
# The landmark opposite each of the left half.
_OPPOSITE = MappingProxyType(
    {
        **{16 - k: k for k in range(3, 8)},
        **{26 - k: 17 + k for k in range(5)},
        **{34: 32, 35: 31, 42: 39, 43: 38, 44: 37, 45: 36, 46: 41, 47: 40},
        **{52: 50, 53: 49, 54: 48, 55: 59, 56: 58, 63: 61, 64: 60, 65: 67},
    }
)
_FACE = {
    **_LEFT,
    **{
        other: LandmarkPlace(_LEFT[own].part, -_LEFT[own].x, _LEFT[own].y, _LEFT[own].spread)
        for own, other in _OPPOSITE.items()
    },
}
# iBUG's numbers of landmarks in MediaPipe's face mesh, where its canonical face model has them at
# the same place within half a centimetre.
_IBUG_OF_MEDIAPIPE: Mapping[int, int] = MappingProxyType(
    {
        **dict(zip((132, 58, 136, 150, 176, 152), range(3, 9), strict=True)),
        **dict(zip((400, 379, 365, 288, 361), range(9, 14), strict=True)),
        **dict(zip((70, 63, 105, 66, 107, 336, 296, 334, 293, 300), range(17, 27), strict=True)),
        **dict(zip((6, 197, 5, 1, 98, 97, 2, 326, 327), range(27, 36), strict=True)),
        **dict(zip((33, 160, 158, 133, 153, 144), range(36, 42), strict=True)),
        **dict(zip((362, 385, 387, 263, 373, 380), range(42, 48), strict=True)),
        **dict(zip((61, 39, 37, 0, 267, 269, 291), range(48, 55), strict=True)),
        **dict(zip((321, 314, 17, 84, 91), range(55, 60), strict=True)),
        **dict(zip((78, 82, 13, 312, 308, 317, 14, 87), range(60, 68), strict=True)),
    }
)
# Landmarks of that mesh where iBUG has none, at the places of its canonical face model (mediapipe
# 0.10, canonical_face_model.obj): forehead, glabella, lids, cheeks, chin.
_MEDIAPIPE_ALONE: Mapping[int, LandmarkPlace] = MappingProxyType(
    {
        151: LandmarkPlace("forehead", 0, 39, 10),
        9: LandmarkPlace("brow", 0, 23, 7),
        386: LandmarkPlace("lid", 31, 5.5, 4),
        374: LandmarkPlace("lid", 31, -5.5, 4),
        280: LandmarkPlace("cheekbone", 48, -33, 8),
        425: LandmarkPlace("cheek", 38, -41, 8),
        411: LandmarkPlace("cheek", 53, -48, 10),
        159: LandmarkPlace("lid", -31, 5.5, 4),
        145: LandmarkPlace("lid", -31, -5.5, 4),
        50: LandmarkPlace("cheekbone", -48, -33, 8),
        205: LandmarkPlace("cheek", -38, -41, 8),
        187: LandmarkPlace("cheek", -53, -48, 10),
        199: LandmarkPlace("chin", 0, -105, 8),
    }
)
_MEDIAPIPE = {
    **{number: _FACE[ibug] for number, ibug in _IBUG_OF_MEDIAPIPE.items()},
    **_MEDIAPIPE_ALONE,
}
_NOSE_TIP = _LEFT[30]
_LAST_IBUG, _LAST_MEDIAPIPE = 67, 477
# Fewer numbers up to 67 may be of any set: iBUG's without the jaw line are 51, without the inner
# corners of the lips 49.
_FEWEST_IBUG, _FEWEST_MEDIAPIPE = 49, 20
# "Landmark" is the word of the trackers; other numbers, as of optical markers, mean nothing.
# All have the same words before and behind these, if any: ``Take01_landmark_30``.
_NUMBERED = re.compile(
    r"(.*[^a-z])?(?:landmark|lmk|ibug|dlib|mediapipe)[ _.-]?(\d{1,3})(\D.*)?",
    re.IGNORECASE | re.DOTALL,
)


def nose_tip_landmark(names: Sequence[str]) -> str:
    """Return the name of a tracker's landmark on the tip of the nose; "" where there is none.

    >>> nose_tip_landmark([f"landmark_{number}" for number in range(68)])
    'landmark_30'
    """
    places = landmark_places(names) or ()
    return next((n for n, place in zip(names, places, strict=False) if place is _NOSE_TIP), "")


def landmark_places(names: Sequence[str]) -> tuple[LandmarkPlace | None, ...] | None:
    """Return the place of each landmark of a tracker; None where the names are not a tracker's.

    Landmarks beside the ears, and those of MediaPipe without a place that rigs share, have none.

    >>> places = landmark_places([f"landmark_{number}" for number in range(68)])
    >>> places[45].part, places[45].x
    ('eye', 46)
    >>> landmark_places(["m1", "m2"]) is None
    True
    """
    matches = [_NUMBERED.fullmatch(name.rsplit(":", 1)[-1]) for name in names]
    numbers = [int(match[2]) for match in matches if match]
    around = {(match[1], match[3]) for match in matches if match}
    if len(numbers) < len(names) or len(set(numbers)) < len(numbers) or len(around) > 1:
        return None
    last = max(numbers, default=0)
    if last <= _LAST_IBUG and len(numbers) >= _FEWEST_IBUG:
        return tuple(_FACE.get(number) for number in numbers)
    if _LAST_IBUG < last <= _LAST_MEDIAPIPE and len(numbers) >= _FEWEST_MEDIAPIPE:
        return tuple(_MEDIAPIPE.get(number) for number in numbers)
    return None
