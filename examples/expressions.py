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
            "eyeSquint": 0.55,
            "eyeWide": 0.35,
            "noseSneer": 0.45,
            "mouthPress": 0.7,
            "mouthFrown": 0.45,
        },
        {"mouthRollLower": 0.25, "mouthRollUpper": 0.25, "jawForward": 0.4, "mouthShrugLower": 0.3},
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
            "browDown": 0.65,
            "mouthUpperUp": 0.8,
            "eyeSquint": 0.7,
            "cheekSquint": 0.7,
            "mouthFrown": 0.6,
            "mouthLowerDown": 0.25,
        },
        {"mouthShrugLower": 0.35},
    ),
    "surprise": _pose(
        {"browOuterUp": 1.0, "eyeWide": 0.9},
        {"browInnerUp": 1.0, "jawOpen": 0.75, "mouthFunnel": 0.35},
    ),
}
