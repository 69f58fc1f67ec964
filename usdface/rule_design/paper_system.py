"""The fuzzy system of the paper, as printed, and its published cases.

M. Zikky, M. Hariadi, Muhtadin, "Semi Automatic Retargeting for Facial Expressions of 3D
Characters with Fuzzy Logic Based on Blendshape Interpolation", EMITTER International Journal
of Engineering Technology 1(1), 2013. The 13 inputs of its six reference poses and the outputs
it prints for them lie in ``usdface/papers/fuzzy_published_cases.csv`` (empty = illegible).

The paper prints neither the memberships nor the normalisation of the outputs. The following
choice meets all 33 legible outputs with an RMS of 0.008 and at most 0.04 off:

* Low, Medium, High are triangles; their feet and outer peaks are the minimum and maximum of
  an input over the six poses, by the paper's design rule; only the peaks of Medium
  (`MEDIUM`) were fitted.
* Each output is normalised over all firing rules. Over its own rules only, as the paper's
  equation 7 is commonly read, the best fit of memberships that was found is off by 0.26.

The system stays as printed, for comparison: its output for a neutral face is anger = 1.
"""

import csv
from dataclasses import dataclass
from importlib.resources import files
from math import inf
from typing import cast

import numpy as np

from usdface.arrays import FloatArray
from usdface.expression_system import Axis, ExpressionSystem, MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

__all__ = [
    "EMOTIONS",
    "MEDIUM",
    "RULES",
    "PublishedCases",
    "paper_system",
    "published_cases",
    "three_terms",
]

EMOTIONS = ("joy", "sadness", "anger", "fear", "disgust", "surprise")

RULES = (
    "IF l_eyebrow_middle_x IS high AND l_orbital_upper_x IS high THEN joy IS 1",
    "IF l_puffer_y IS high THEN joy IS 0.5",
    "IF lip_lower_y IS high AND middle_chin_y IS high THEN joy IS 1",
    # Printed as l_eyelid_upper_x, an input that the paper does not have.
    "IF l_eyebrow_middle_y IS high AND l_eyelid_upper_y IS high THEN sadness IS 1",
    "IF l_eyebrow_end_z IS low AND l_orbital_upper_z IS low THEN anger IS 1",
    "IF l_eyelid_upper_y IS medium THEN anger IS 0.5",
    "IF l_orbital_upper_z IS high AND l_eyelid_upper_z IS high AND middle_chin_z IS high "
    "THEN fear IS 1",
    "IF l_eyebrow_middle_z IS high AND l_eyebrow_end_z IS high AND l_eyelid_upper_z IS high "
    "THEN disgust IS 1",
    "IF lip_lower_y IS medium AND middle_chin_z IS high THEN disgust IS 0.7",
    "IF l_eyebrow_end_z IS medium THEN surprise IS 0.5",
    # Printed twice; it counts once.
    "IF l_orbital_upper_x IS medium THEN surprise IS 0.5",
    "IF l_eyelid_upper_z IS high AND middle_chin_z IS medium THEN surprise IS 1",
)

# Least squares over the published outputs (`python benchmarks/paper_fit.py`). Four do not affect
# them (`middle_chin_y` below 1.1, both other eyebrow_middle and eyebrow_end_x anywhere): these are
# the middle of the range.
MEDIUM = {
    "l_eyebrow_middle_x": 0.90,
    "l_eyebrow_middle_y": 0.68,
    "l_eyebrow_middle_z": 0.527,
    "l_eyebrow_end_x": 0.82,
    "l_eyebrow_end_z": 1.036,
    "l_orbital_upper_x": 1.789,
    "l_orbital_upper_z": 0.988,
    "l_eyelid_upper_y": 0.62,
    "l_eyelid_upper_z": 0.6355,
    "l_puffer_y": 0.516,
    "lip_lower_y": 1.2098,
    "middle_chin_y": 1.0,
    "middle_chin_z": 0.5437,
}


@dataclass(frozen=True, eq=False, slots=True)
class PublishedCases:
    """The paper's six reference poses.

    Attributes
    ----------
    poses : tuple of str, length 6
    inputs : (6, 13) float64
        Features of the poses, columns as `MEDIUM`.
    outputs : (6, 6) float64
        Columns as `EMOTIONS`; NaN = illegible in print.
    """

    poses: tuple[str, ...]
    inputs: FloatArray
    outputs: FloatArray


def paper_system() -> ExpressionSystem:
    """Return the paper's system: 13 inputs, 12 rules, absolute features, no else rule.

    Features stay undivided (`face_unit` "none"): the paper names no unit for its figures, so
    on another recording its terms fit only after the features are brought to the same scale.
    """
    printed = published_cases().inputs
    low, high = printed.min(axis=0), printed.max(axis=0)
    inputs = tuple(
        Variable(name, "input", three_terms(float(low[i]), medium, float(high[i])))
        for i, (name, medium) in enumerate(MEDIUM.items())
    )
    features = tuple(
        MarkerFeature(role, cast("Axis", axis), "absolute")
        for role, axis in (name.rsplit("_", 1) for name in MEDIUM)
    )
    outputs = tuple(Variable(emotion, "output") for emotion in EMOTIONS)
    rules = tuple(parse_rule(text) for text in RULES)
    fuzzy = FuzzySystem(inputs + outputs, rules, normalisation="all_rules")
    return ExpressionSystem(fuzzy, features, space="take", face_unit="none", mode="add")


def three_terms(low: float, medium: float, high: float) -> tuple[Term, ...]:
    """Return Low, Medium and High of an input by the paper's design rule.

    Triangles whose feet and peaks are the input's minimum, medium and maximum over the reference
    poses; values outside belong fully to Low or High.
    """
    return (
        Term("low", "triangular", (-inf, low, medium)),
        Term("medium", "triangular", (low, medium, high)),
        Term("high", "triangular", (medium, high, inf)),
    )


def published_cases() -> PublishedCases:
    """Read the published figures."""
    text = files("usdface").joinpath("papers", "fuzzy_published_cases.csv").read_text("utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    inputs = [[float(row[name]) for name in MEDIUM] for row in rows]
    outputs = [[float(row[f"published_{e}"] or "nan") for e in EMOTIONS] for row in rows]
    return PublishedCases(tuple(row["pose"] for row in rows), np.array(inputs), np.array(outputs))
