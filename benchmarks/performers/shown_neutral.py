"""The error of takes whose neutral frames show some blend shapes of the performer."""

from pathlib import Path

import numpy as np

from benchmarks.performers.worlds import JUDGED_ON, ROWS, Performance, perform
from usdface.arrays import FloatArray, IntArray

__all__ = [
    "BUILT_ON_20_S",
    "JUDGED_ON_20_S",
    "NEUTRALS",
    "shown_weights",
    "with_neutral",
]

# Frames of the recorded curves, 20 s: what the estimate was built with, and what judges it.
BUILT_ON_20_S, JUDGED_ON_20_S = slice(600, 1200), slice(2915, 3515)
# Weights of blend shapes by the beginning of their name, both sides.
NEUTRALS: dict[str, dict[str, float]] = {
    "nothing": {},
    "smile 0.2, inner brows up 0.15": {"mouthSmile": 0.2, "browInnerUp": 0.15},
    "mouth open 0.1": {"jawOpen": 0.1},
    "brows down 0.2": {"browDown": 0.2},
    "lids 0.2": {"eyeBlink": 0.2},
    "ten shapes at 0.05": {
        name: 0.05
        for name in (
            "mouthSmile",
            "browInnerUp",
            "jawOpen",
            "mouthPucker",
            "eyeSquint",
            "noseSneer",
        )
    },
    "drawn": {},  # for each performer: about a fifth of the pairs, at 0.03 to 0.2
}


def shown_weights(name: str, shape_names: tuple[str, ...], seed: int) -> FloatArray:
    """Return the weights (S,) of a neutral of `NEUTRALS`."""
    stems = [each.removesuffix("_L").removesuffix("_R") for each in shape_names]
    weights = NEUTRALS[name]
    if name == "drawn":
        rng = np.random.default_rng(2000 + seed)
        drawn = {stem: float(rng.uniform(0.03, 0.2)) for stem in sorted(set(stems))}
        weights = {stem: weight for stem, weight in drawn.items() if rng.random() < 0.2}
    return np.array([weights.get(stem, 0.0) for stem in stems])


def with_neutral(
    data: Path,
    number: int,
    name: str,
    shape_names: tuple[str, ...],
    markers: IntArray | None = None,
) -> Performance:
    """Return a take of performer `number` whose neutral frames show a neutral of `NEUTRALS`.

    `markers` are those of `perform`.
    """
    shown = shown_weights(name, shape_names, number)
    part = JUDGED_ON_20_S if number in JUDGED_ON else BUILT_ON_20_S
    return perform(data, number, ROWS[0], part=part, shown=shown, markers=markers)
