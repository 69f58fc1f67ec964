"""The six basic emotions as full poses of the example's blend shapes.

Which muscles an emotion takes follows the action units that P. Ekman and W. V. Friesen's
"Facial Action Coding System" (1978) and EMFACS name for it; the amounts suit this head.
"""

__all__ = ["EMOTIONS"]


def _pose(both: dict[str, float], single: dict[str, float]) -> dict[str, float]:
    sides = {name + side: weight for name, weight in both.items() for side in ("Left", "Right")}
    return {**sides, **single}


EMOTIONS: dict[str, dict[str, float]] = {
    "joy": _pose(
        {
            "mouthSmile": 1.0,
            "cheekSquint": 0.9,
            "eyeSquint": 0.5,
            "mouthUpperUp": 0.45,
            "mouthDimple": 0.2,
            "browOuterUp": 0.3,
        },
        {"jawOpen": 0.25, "browInnerUp": 0.15},
    ),
    "sadness": _pose(
        {
            "mouthFrown": 1.0,
            "eyeBlink": 0.22,
            "eyeLookDown": 0.35,
            "browDown": 0.15,
            "mouthLowerDown": 0.05,
        },
        {"browInnerUp": 1.0, "mouthShrugLower": 0.55},
    ),
    "anger": _pose(
        {
            "browDown": 1.0,
            "eyeSquint": 0.7,
            "eyeWide": 0.4,
            "noseSneer": 0.15,
            "mouthPress": 1.0,
            "mouthFrown": 0.2,
        },
        {"mouthRollLower": 0.35, "mouthRollUpper": 0.35},
    ),
    "fear": _pose(
        {
            "eyeWide": 1.0,
            "browOuterUp": 0.35,
            "browDown": 0.2,
            "mouthStretch": 0.9,
            "mouthLowerDown": 0.5,
            "mouthFrown": 0.35,
        },
        {"browInnerUp": 1.0, "jawOpen": 0.28},
    ),
    "disgust": _pose(
        {
            "noseSneer": 1.0,
            "browDown": 0.35,
            "mouthUpperUp": 0.75,
            "eyeSquint": 0.6,
            "cheekSquint": 0.4,
            "mouthFrown": 0.55,
            "mouthLowerDown": 0.5,
        },
        {},
    ),
    "surprise": _pose(
        {"browOuterUp": 1.0, "eyeWide": 0.9},
        {"browInnerUp": 1.0, "jawOpen": 0.75, "mouthFunnel": 0.35},
    ),
}
