"""Worlds to develop `usdface fuzzy fit` on: FACS variants on the ICT face.

`python benchmarks/fuzzy_variants.py`. Each world draws two or three of the prototypes and major
variants of six emotions (P. Ekman, W. Friesen, J. Hager, "Facial Action Coding System:
Investigator's Guide", 2002) and shows them on blend shapes, measured at the 68 landmarks without
a solve. MakeHuman's published expressions (`fuzzy_fit.py`) stay unseen meanwhile.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from fuzzy_fit import emotions_only, nearest_mean, rules_and_fallback  # noqa: E402
from ict_face import ict_mesh, landmarks  # noqa: E402

from usdface.face.bound_face import BoundFace, bound_face  # noqa: E402
from usdface.rule_design.marker_roles import (  # noqa: E402
    direction_names,
    known_roles,
    marker_features,
)
from usdface.rule_design.movements import single_movements  # noqa: E402
from usdface.rule_learning.cross_validation import cross_validate  # noqa: E402
from usdface.rule_learning.examples import NO_EMOTION, Examples  # noqa: E402
from usdface.rule_learning.labelled_takes import feature_noise, pose_features  # noqa: E402
from usdface.rule_learning.learned_system import fit_system  # noqa: E402
from usdface.setup.binding import Binding  # noqa: E402
from usdface.setup.retarget_setup import RetargetSetup  # noqa: E402

PERFORMERS = 6
# Of the markers' noise what smoothing leaves.
NOISE = 0.35
VARIANTS: dict[str, tuple[tuple[int, ...], ...]] = {
    "surprise": ((1, 2, 5, 26), (1, 2, 5), (1, 2, 26), (5, 26)),
    "fear": ((1, 2, 4, 5, 20, 26), (1, 2, 4, 5, 26), (1, 2, 4, 5, 20), (1, 2, 4, 5), (5, 20)),
    "joy": ((6, 12), (12,), (6, 12, 26), (12, 10, 16)),
    "sadness": ((1, 4, 15), (6, 15), (1, 4, 15, 17), (1, 4, 17), (1, 15)),
    "disgust": ((9,), (9, 16, 15, 26), (9, 17), (10,), (10, 16, 26), (10, 17)),
    "anger": (
        (4, 5, 7, 10, 22, 23), (4, 5, 7, 10, 23, 26), (4, 5, 7, 23), (4, 5, 7, 17, 23),
        (4, 5, 7, 17, 24), (4, 7, 23), (4, 5, 23), (4, 7, 10, 23),
    ),
}  # fmt: skip
SPEECH = ({"jawOpen": 0.3}, {"jawOpen": 0.2, "mouthFunnel": 0.6})
# Blend shapes of each action unit; `_` stands for both sides.
UNITS: dict[int, tuple[str, ...]] = {
    1: ("browInnerUp_",),
    2: ("browOuterUp_",),
    4: ("browDown_",),
    5: ("eyeWide_",),
    6: ("cheekSquint_",),
    7: ("eyeSquint_",),
    9: ("noseSneer_",),
    10: ("mouthUpperUp_",),
    12: ("mouthSmile_",),
    15: ("mouthFrown_",),
    16: ("mouthLowerDown_",),
    17: ("mouthShrugLower",),
    20: ("mouthStretch_",),
    22: ("mouthFunnel",),
    23: ("mouthPress_", "mouthRollLower"),
    24: ("mouthPress_", "mouthRollUpper"),
    26: ("jawOpen",),
}
STRENGTH = {26: 0.45}


def world(seed: int, face: BoundFace) -> Examples:
    """Return what six performers show of the variants that the seed draws."""
    rng = np.random.default_rng(1000 + seed)
    drawn = {
        emotion: [known[i] for i in sorted(rng.permutation(len(known))[: rng.integers(2, 4)])]
        for emotion, known in VARIANTS.items()
    }
    index = {name: i for i, name in enumerate(face.shape_names)}
    weights: list[np.ndarray] = []
    labels: list[tuple[str, str, str]] = []

    def show(pose: Mapping[str, float], emotion: str, variant: str, performer: int) -> None:
        row = np.zeros(len(index))
        for name, weight in pose.items():
            row[index[name]] += weight
        weights.append(np.clip(row, 0, 1) * rng.uniform(0.5, 1.0))
        labels.append((emotion, variant, f"performer_{performer}"))

    for performer in range(PERFORMERS):
        show({}, NO_EMOTION, "", performer)
        for emotion, variants in drawn.items():
            for number, units in enumerate(variants):
                pose: dict[str, float] = {}
                for unit in units:
                    size = STRENGTH.get(unit, 0.8) * rng.uniform(0.7, 1.3)
                    shapes = [n + side for n in UNITS[unit] for side in sides(n)]
                    for name in shapes:
                        pose[name] = pose.get(name, 0.0) + size * rng.uniform(0.9, 1.1)
                show(pose, emotion, f"{emotion}_{number}", performer)
        for speech in SPEECH:
            spoken = {name: weight * rng.uniform(0.7, 1.3) for name, weight in speech.items()}
            show(spoken, NO_EMOTION, "speech", performer)
    variables = marker_features(known_roles(face.markers, face.roles), "signed")
    noise = feature_noise(face, "take")
    features = pose_features(np.array(weights), face, variables)
    features = features + NOISE * noise * rng.standard_normal(features.shape)
    emotions, variants_shown, recordings = zip(*labels, strict=True)
    return Examples(
        variables,
        direction_names(face.neutral, face.nose),
        features,
        emotions,
        variants_shown,
        recordings,
        np.ones(len(labels)),
        noise,
        pose_features(single_movements(face.shape_names), face, variables),
    )


def sides(shape: str) -> tuple[str, ...]:
    """Return the suffixes of a shape's name."""
    return ("L", "R") if shape.endswith("_") else ("",)


def rejecting_nearest_mean(kept: Examples, left: Examples) -> tuple[np.ndarray, tuple[str, ...]]:
    """Classify as `nearest_mean` does, but reject where speech or a blend shape alone is nearer."""
    outputs, names = nearest_mean(kept, left)
    scale = np.abs(kept.features).max(axis=0)
    moves = scale > 0
    speech = kept.features[kept.rows(NO_EMOTION, "speech")].mean(axis=0)
    nothing = np.vstack([speech, kept.movements])[:, moves] / scale[moves]
    faces = left.features[:, moves] / scale[moves]
    lengths = np.linalg.norm(faces, axis=1)[:, None] * np.linalg.norm(nothing, axis=1)
    nearer = faces @ nothing.T / np.maximum(lengths, 1e-12)
    return np.where((nearer > outputs.max(axis=1)[:, None]).any(axis=1)[:, None], 0, outputs), names


def variants_face() -> BoundFace:
    mesh, marks = ict_mesh(SHARED), landmarks(SHARED)
    names = tuple(f"landmark_{i}" for i in range(len(marks)))
    setup = RetargetSetup(Binding(names, marks), nose_tip="landmark_30")
    return bound_face(mesh, setup)


def figures() -> dict[str, float]:
    """Return what `benchmarks/sensitivity.py` judges rule learning by, on worlds 0 and 1."""
    face, found = variants_face(), {"rules": 0.0, "new performers": 0.0, "new variants": 0.0}
    for seed in (0, 1):
        data = world(seed, face)
        found["rules"] += len(fit_system(data).system.fuzzy.rules)
        for name, holding in (("new performers", "recording"), ("new variants", "variant")):
            found[name] += float(np.trace(cross_validate(data, holding).counts[:-1]))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, nargs="*", default=[0, 1, 2, 3])
    face = variants_face()
    for seed in parser.parse_args().worlds:
        data = world(seed, face)
        learned = fit_system(data)
        performers = cross_validate(data, "recording")
        neutral = performers.counts[-1]
        print(
            f"world {seed}: {rules_and_fallback(learned)} rules and fallback rules; "
            f"new performer {emotions_only(performers)}, "
            f"no emotion {neutral[-1]} of {neutral.sum()}; new variant "
            f"{emotions_only(cross_validate(data, 'variant'))}, nearest mean "
            f"{emotions_only(cross_validate(data, 'variant', nearest_mean))}, "
            f"rejecting blend shapes "
            f"{emotions_only(cross_validate(data, 'variant', rejecting_nearest_mean))}",
            flush=True,
        )


if __name__ == "__main__":
    main()
