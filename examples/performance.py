"""The example's take: an under-expressive performer of another build, with 42 markers.

The performer is the same head, bent into other proportions: about 12 s of the six emotions at
60 to 70 %, blinks, a little speech, head motion, marker noise and occlusions.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from examples.expressions import EMOTIONS
from examples.head import build_head
from examples.sculpt import march
from usdface.arrays import FloatArray
from usdface.rigs import Rig
from usdface.setup.binding import Binding
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["MARKERS", "NEUTRAL", "Performance", "bent_as_performer", "binding", "perform", "record"]

RATE = 60.0
SECONDS = 12.0
NEUTRAL = (0, 29)
SEED = 20250521
NOISE = 0.0002  # [m], standard deviation of each coordinate

# Markers on the midline and the left half, seen from the front [mm]; the left ones have a
# twin on the right.
MIDDLE = {
    "forehead_middle": (0, 60),
    "nose_bridge": (0, 4),
    "nose_tip": (0, -33),
    "lip_upper": (0, -62.5),
    "lip_lower": (0, -72),
    "chin": (0, -97),
}
LEFT = {
    "forehead_left": (30, 62),
    "temple_left": (66, 12),
    "brow_left_inner": (14, 36),
    "brow_left_middle": (32, 41),
    "brow_left_outer": (52, 36),
    "lid_upper_left": (36, 14),
    "lid_lower_left": (36, -13),
    "nose_left": (15, -38),
    "cheek_left": (38, -34),
    "cheek_left_outer": (58, -26),
    "cheek_left_lower": (47, -60),
    "nasolabial_left": (25, -47),
    "lip_upper_left": (12, -62.5),
    "lip_lower_left": (12, -71.5),
    "lip_corner_left": (26.5, -65.5),
    "chin_left": (17, -94),
    "jaw_left": (46, -82),
    "lip_crease_left": (14, -82),
}
MARKERS = (*MIDDLE, *(n for m in LEFT for n in (m, m.replace("left", "right"))))


@dataclass(frozen=True, eq=False)
class Performance:
    """A take and what is true about it.

    Attributes
    ----------
    take : MarkerTake
    weights : WeightsTake
        The weights of the rig's shapes that the performer shows, (F, S).
    amounts : (F, E)
        How much of each emotion of `EMOTIONS` is in them, in that order.
    clean : (F, M, 3) [m]
        The markers without head motion, noise and occlusions.
    """

    take: MarkerTake
    weights: WeightsTake
    amounts: FloatArray
    clean: FloatArray


@lru_cache(maxsize=1)
def binding() -> Binding:
    """Return the vertex of the head under each marker; twins sit on mirrored vertices."""
    points = build_head().mesh("head").points
    places = np.array([(x, y) for name in MARKERS for x, y in [_place(name)]]) / 1000
    origins = np.column_stack([places, np.full(len(places), 0.01)])
    skin = march(origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape))
    away = np.linalg.norm(points - skin[:, None], axis=2)
    return Binding(MARKERS, np.argmin(away, axis=1), mesh="head")


def _place(marker: str) -> tuple[float, float]:
    if marker in MIDDLE:
        return MIDDLE[marker]
    x, y = LEFT[marker.replace("right", "left")]
    return (x, y) if "left" in marker else (-x, y)


def ease(x: FloatArray) -> FloatArray:
    """Return the minimum-jerk step from 0 at x <= 0 to 1 at x >= 1."""
    x = np.clip(x, 0, 1)
    return np.asarray(x**3 * (10 - 15 * x + 6 * x**2))


def _swell(times: FloatArray, start: float, rise: float, hold: float, fall: float) -> FloatArray:
    return ease((times - start) / rise) - ease((times - start - rise - hold) / fall)


def _curves(rig: Rig, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weights (F, S) and amounts (F, E); each muscle has a little delay of its own."""
    random = np.random.default_rng(SEED)
    names = rig.shape_names
    column = {name: i for i, name in enumerate(names)}
    weights = np.zeros((len(times), len(names)))
    amounts = np.zeros((len(times), len(EMOTIONS)))
    for slot, pose in enumerate(EMOTIONS.values()):
        start, size = 0.5 + 1.55 * slot, random.uniform(0.60, 0.70)
        rise, hold, fall = random.uniform((0.35, 0.50, 0.35), (0.45, 0.60, 0.45))
        amounts[:, slot] = size * _swell(times, start, rise, hold, fall)
        for name, weight in pose.items():
            stem = name.removesuffix("Left").removesuffix("Right")
            late = np.random.default_rng([SEED, slot, *stem.encode()]).uniform(0, 0.06)
            uneven = random.uniform(0.93, 1.0)  # no face is quite symmetric
            curve = _swell(times, start + late, rise, hold, fall)
            weights[:, column[name]] += size * weight * uneven * curve
    # Speech: the jaw in syllables, the lips between rounding and spreading.
    talk = _swell(times, 9.95, 0.15, 1.35, 0.2)
    syllable = 0.5 - 0.5 * np.cos(2 * np.pi * 4.3 * (times - 9.95) + 0.8 * np.sin(9 * times))
    word = 0.5 - 0.5 * np.cos(2 * np.pi * 1.3 * (times - 9.95))
    spoken = {
        "jawOpen": 0.30 * syllable,
        "mouthFunnel": 0.35 * word,
        "mouthStretchLeft": 0.22 * (1 - word),
        "mouthStretchRight": 0.22 * (1 - word),
        "mouthLowerDownLeft": 0.25 * syllable,
        "mouthLowerDownRight": 0.25 * syllable,
    }
    for name, curve in spoken.items():
        weights[:, column[name]] += talk * curve
    for start in (1.95, 3.42, 4.60, 8.05, 9.72, 11.10):
        blink = _swell(times, start, 0.09, 0.03, 0.16)
        for side in ("Left", "Right"):
            place = column[f"eyeBlink{side}"]
            weights[:, place] = np.maximum(weights[:, place], blink)
    return np.clip(weights, 0, 1), amounts


def bent_as_performer(points: FloatArray) -> FloatArray:
    """Bend the example's head into the performer's: longer, narrower, wider jaw, big nose."""
    x, y, z = np.moveaxis(points, -1, 0)
    nose = np.exp(-((x / 0.018) ** 2) - ((y + 0.028) / 0.020) ** 2)
    wide = 0.93 - 0.9 * y - 4.0 * y**2
    bent = np.stack([x * wide, 1.10 * y + 0.12 * y * z, 0.95 * z + 0.007 * nose], axis=-1)
    return np.asarray(1.04 * bent)


def _rotations(angles: FloatArray) -> FloatArray:
    """Return rotation matrices (F, 3, 3) of pitch, yaw, roll (F, 3) [degree]."""
    c, s = np.cos(np.radians(angles)).T, np.sin(np.radians(angles)).T
    one, nil = np.ones(len(angles)), np.zeros(len(angles))
    rx = np.array([[one, nil, nil], [nil, c[0], -s[0]], [nil, s[0], c[0]]])
    ry = np.array([[c[1], nil, s[1]], [nil, one, nil], [-s[1], nil, c[1]]])
    rz = np.array([[c[2], -s[2], nil], [s[2], c[2], nil], [nil, nil, one]])
    return np.asarray(np.einsum("abf,bcf,cdf->fad", ry, rx, rz))


def _moved(markers: FloatArray, times: FloatArray) -> FloatArray:
    """Add the head's motion about the neck, and where the performer sits [m]."""
    t = times[:, None]
    begun = ease((t - 0.35) / 1.0)
    rates, phases = np.array([0.31, 0.22, 0.27]), np.array([0.4, 2.1, 4.0])
    swing = np.sin(2 * np.pi * rates * t + phases) + 0.35 * np.sin(5.1 * rates * t * 2 + phases)
    angles = begun * swing * (4.0, 6.5, 2.5)
    drift = begun * np.sin(2 * np.pi * rates[::-1] * t + 2 * phases) * (0.010, 0.006, 0.014)
    neck = np.array([0, -0.12, -0.03])
    turned = np.einsum("fab,fmb->fma", _rotations(angles), markers - neck) + neck
    return np.asarray(turned + drift[:, None] + (0.06, 0.14, 0.11))


def _clean(weights: FloatArray) -> FloatArray:
    """Return the performer's markers (F, M, 3) at weights of the rig's shapes (F, S) [m]."""
    rig, bound = build_head(), binding()
    head = rig.mesh("head")
    used = [rig.shape_names.index(name) for name in head.shape_names]
    offsets = head.offsets_at(bound.points)
    skin = head.points[bound.points] + np.tensordot(weights[:, used], offsets, 1)
    return bent_as_performer(skin)


def record(weights: FloatArray, times: FloatArray, random: np.random.Generator) -> MarkerTake:
    """Return the take in which the performer shows weights (F, S), with motion and noise."""
    clean = _clean(weights)
    seen = _moved(clean, times) + random.normal(0, NOISE, clean.shape)
    return MarkerTake(MARKERS, times, seen, rate=RATE, meters_per_unit=0.001)


@lru_cache(maxsize=1)
def perform() -> Performance:
    """Perform: the take, and the truth behind it. The same on every call."""
    rig = build_head()
    times = np.arange(round(SECONDS * RATE)) / RATE
    weights, amounts = _curves(rig, times)
    clean = _clean(weights)
    random = np.random.default_rng(SEED + 1)
    seen = _moved(clean, times) + random.normal(0, NOISE, clean.shape)
    for marker, start, end in (
        ("chin", 2.60, 2.85),
        ("lip_corner_left", 5.30, 5.42),
        ("cheek_right_outer", 6.10, 7.00),
        ("jaw_right", 6.20, 6.85),
        ("lid_upper_left", 8.06, 8.22),
        ("lip_lower", 10.40, 10.50),
    ):
        seen[(times >= start) & (times < end), MARKERS.index(marker)] = np.nan
    take = MarkerTake(MARKERS, times, seen, rate=RATE, meters_per_unit=0.001)
    return Performance(take, WeightsTake(rig.shape_names, times, weights, RATE), amounts, clean)
