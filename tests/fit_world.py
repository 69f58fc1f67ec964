"""Labelled examples of a made-up face whose rule base is known."""

from dataclasses import replace

import numpy as np

from usdface.rule_design.marker_roles import AXES, direction_name, marker_features
from usdface.rule_learning.examples import NO_EMOTION, Examples

MARKERS = ("nose", "brow_l", "cheek_l", "corner_l", "lip_low", "chin")
_SIDES = (0, 1, 1, 1, 0, 0)
NOISE = 0.004

# What every emotion is, and what moves without one: speech, a frown of concentration.
RULES = {
    ("joy", ""): {"corner_l_y raised"},
    ("surprise", ""): {"brow_l_y raised", "chin_y lowered"},
    ("fear", ""): {"brow_l_y raised", "corner_l_x outward"},
    ("anger", "closed"): {"brow_l_y lowered", "lip_low_y raised"},
    ("anger", "open"): {"brow_l_y lowered", "chin_y lowered"},
    ("contempt", ""): {"cheek_l_y raised", "corner_l_x inward"},
}
_ALONE = ("brow_l_y raised", "brow_l_y lowered", "chin_y lowered", "corner_l_x outward")
_ALONE += ("lip_low_y raised", "cheek_l_y raised", "corner_l_x inward")
_SIGNS = {"raised": 1, "lowered": -1, "outward": 1, "inward": -1}
_REACH = {"brow_l_y": 0.08, "chin_y": 0.2, "corner_l_x": 0.06, "corner_l_y": 0.09}

VARIABLES = marker_features(MARKERS)
COLUMN = {variable.name: i for i, variable in enumerate(VARIABLES)}


def face(*motions: str) -> np.ndarray:
    """Return the features of a face that makes some motions fully."""
    features = np.zeros(len(VARIABLES))
    for motion in motions:
        name, word = motion.split()
        features[COLUMN[name]] = _SIGNS[word] * _REACH.get(name, 0.05)
    return features


def make_examples(rules=RULES, takes=4, scatter=0.1, seed=0) -> Examples:
    """Show every emotion twice in each take, about as strongly as `face` has it."""
    rng = np.random.default_rng(seed)
    rows, labels = [], []
    nothing = [((NO_EMOTION, ""), [motion]) for motion in _ALONE]
    for take in range(takes):
        for (emotion, variant), motions in [*rules.items(), *nothing, ((NO_EMOTION, ""), [])]:
            for _ in range(2):
                size = 1 + scatter * rng.standard_normal(len(VARIABLES))
                rows.append(face(*sorted(motions)) * size)
                labels.append((emotion, variant, f"take_{take}"))
    emotions, variants, recordings = zip(*labels, strict=True)
    words = tuple(
        (direction_name(axis, -1, side), direction_name(axis, 1, side))
        for side in _SIDES
        for axis in AXES
    )
    features = np.array(rows)
    return Examples(
        VARIABLES,
        words,
        features + 0.25 * NOISE * rng.standard_normal(features.shape),
        emotions,
        variants,
        recordings,
        np.ones(len(rows)),
        np.full(len(VARIABLES), NOISE),
        np.zeros((0, len(VARIABLES))),
    )


def without_variants(examples: Examples) -> Examples:
    return replace(examples, variants=("",) * len(examples.variants))
