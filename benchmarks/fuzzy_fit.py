"""Fitted systems on MakeHuman's expressions: `python benchmarks/fuzzy_fit.py`.

Joint poses move the mesh, the mesh carries markers, and the markers go through the clean-up, the
solve on MakeHuman's blend shapes and `usdface fuzzy fit`. Seeds are fixed. See README.md.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import landmarks  # noqa: E402
from makehuman_face import (  # noqa: E402
    Posable,
    landmarks_on,
    posable_face,
    published_expressions,
)

from usdface.correction.feature_extraction import features  # noqa: E402
from usdface.face.bound_face import BoundFace, bound_face  # noqa: E402
from usdface.fuzzy.inference import evaluate  # noqa: E402
from usdface.io.bind_file import read_bind  # noqa: E402
from usdface.io.rigs.makehuman import read_makehuman  # noqa: E402
from usdface.options import FeatureSpace, FitOptions  # noqa: E402
from usdface.progress import Progress  # noqa: E402
from usdface.retarget_take.clean_and_solve import clean_and_solve  # noqa: E402
from usdface.rule_design.marker_roles import known_roles  # noqa: E402
from usdface.rule_learning.cross_validation import Validation, cross_validate  # noqa: E402
from usdface.rule_learning.examples import NO_EMOTION, Examples  # noqa: E402
from usdface.rule_learning.labelled_takes import examples_of  # noqa: E402
from usdface.rule_learning.labels import NEUTRAL, NOTHING, Label  # noqa: E402
from usdface.rule_learning.learned_system import (  # noqa: E402
    LearnedSystem,
    classify,
    evaluate_examples,
    fit_system,
)
from usdface.rule_learning.separation import separations  # noqa: E402
from usdface.setup.binding import Binding  # noqa: E402
from usdface.setup.retarget_setup import RetargetSetup  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

RATE, NOISE, PERFORMERS = 60.0, 0.0003, 6
REST, RISE, HOLD = 60, 20, 20
# The tags that the files carry.
EMOTIONS = {
    "anger": ("anger01", "threaten01"),
    "disgust": ("disgust01",),
    "fear": ("fear01",),
    "delight": ("smile01", "smile02"),
    "sadness": ("sad01", "cry01"),
    "surprise": ("surprise01",),
    "amusement": ("laugh01",),
    "boredom": ("boring01", "sleep01", "stunned01"),
    "courage": ("determination01", "determination02"),
    "doubt": ("doubt01", "sceptical01"),
    "interest": ("attention01",),
    "tension": ("effort01",),
    NOTHING: ("vocalize01",),
}
SIX = ("anger", "disgust", "fear", "delight", "sadness", "surprise", NOTHING)
# A mouth that opens over any of them.
OPEN = {"JawDrop": 0.4}


def shown(emotions: tuple[str, ...], opened: bool) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Yield (emotion, variant, unit poses); `opened` adds each once more with the mouth open."""
    published = published_expressions(SHARED)
    for emotion in emotions:
        for variant in EMOTIONS[emotion]:
            pose = published[variant]
            yield emotion, variant, pose
            if opened and emotion != NOTHING and pose.get("JawDrop", 0.0) < OPEN["JawDrop"]:
                yield emotion, f"{variant}_open", pose | OPEN


@cache
def performed(
    body: Posable, face: BoundFace, emotions: tuple[str, ...], opened: bool
) -> tuple[dict[Path, MarkerTake], list[Label]]:
    """Record performers who show everything once: unit poses scatter, intensities too."""
    at = face.vertices
    takes, labels = {}, []
    ease = np.concatenate([np.linspace(0, 1, RISE), np.ones(HOLD), np.linspace(1, 0, RISE)])
    marked = replace(body, points=body.points[at], weights=body.weights[at])
    for performer in range(PERFORMERS):
        rng = np.random.default_rng(performer)
        path = Path(f"performer_{performer}")
        labels.append(Label(path, 0, REST - 20, "frame", NEUTRAL))
        parts = [np.repeat(marked.points[None], REST, axis=0)]
        for emotion, variant, pose in shown(emotions, opened):
            size = rng.uniform(0.5, 1.0)
            blend = {u: size * w * rng.uniform(0.7, 1.3) for u, w in pose.items()}
            steps = {e: marked.posed({u: e * w for u, w in blend.items()}) for e in set(ease)}
            begin = sum(map(len, parts))
            parts.append(np.array([steps[e] for e in ease]))
            labels.append(Label(path, begin, begin + len(ease) - 1, "frame", emotion, variant))
        positions = np.concatenate(parts)
        positions = positions + NOISE * rng.standard_normal(positions.shape)
        times = np.arange(len(positions)) / RATE
        takes[path] = MarkerTake(face.markers, times, positions, RATE)
    return takes, labels


def examples(
    body: Posable, face: BoundFace, emotions: tuple[str, ...], opened: bool, space: FeatureSpace
) -> Examples:
    takes, labels = performed(body, face, emotions, opened)
    options = FitOptions(space=space)
    read = {"read": lambda p: (takes[p], []), "options": options, "progress": Progress()}
    found, _ = examples_of(labels, face, setup_of(face), **read)
    return found.examples


def nearest_mean(kept: Examples, left: Examples) -> tuple[np.ndarray, tuple[str, ...]]:
    """Take each face for the nearest class mean of all features, in direction: the yardstick."""
    names = kept.names
    scale = np.abs(kept.features).max(axis=0)
    moves = scale > 0
    known, faces = (e.features[:, moves] / scale[moves] for e in (kept, left))
    means = np.array([known[kept.rows(name)].mean(axis=0) for name in names])
    lengths = np.linalg.norm(faces, axis=1)[:, None] * np.linalg.norm(means, axis=1)
    return np.clip(faces @ means.T / lengths, 0, 1), names


def emotions_only(found: Validation) -> str:
    counts = found.counts[:-1]
    right, total = int(np.trace(counts)), int(counts.sum())
    return f"{right} of {total} ({100 * right / max(total, 1):.0f} %)"


def rules_and_fallback(learned: LearnedSystem) -> str:
    fallback = len(learned.fallback_rules)
    return f"{len(learned.system.fuzzy.rules) - fallback} + {fallback}"


def summary(bodies: dict[str, tuple[Posable, BoundFace]]) -> Table:
    table = Table(title=f"Held-out expressions recognised; {PERFORMERS} performers, 0.3 mm noise")
    for column in ("emotions", "markers", "space", "rules + fallback; most conditions"):
        table.add_column(column)
    for column in ("new performer", "nearest mean", "new variant", "nearest mean", "no emotion"):
        table.add_column(column, justify="right")
    for title, emotions in (("six", SIX), ("twelve", tuple(EMOTIONS))):
        for markers, (body, face) in bodies.items():
            for space in ("character", "take"):
                data = examples(body, face, emotions, False, space)
                learned = fit_system(data, space)
                system = learned.system
                rest = evaluate_examples(system, data)[~np.array([bool(e) for e in data.emotions])]
                longest = max(len(rule.propositions) for rule in system.fuzzy.rules)
                table.add_row(
                    title,
                    markers,
                    space,
                    f"{rules_and_fallback(learned)}; {longest}",
                    emotions_only(cross_validate(data, "recording")),
                    emotions_only(cross_validate(data, "recording", nearest_mean)),
                    emotions_only(cross_validate(data, "variant")),
                    emotions_only(cross_validate(data, "variant", nearest_mean)),
                    f"{rest.max():.2f}",
                )
    return table


def confusion(found: Validation, title: str) -> Table:
    table = Table(title=title)
    labels = [*found.names, "none"]
    for name in ("shown", *labels, "margin", "worst"):
        table.add_column(name, justify="left" if name == "shown" else "right")
    for label, row in zip(labels, found.counts, strict=True):
        margins = found.margins_of(NO_EMOTION if label == "none" else label)
        figures = [f"{margins.mean():+.2f}", f"{margins.min():+.2f}"] if margins.size else ["", ""]
        table.add_row(label, *(str(n) if n else "." for n in row), *figures)
    return table


def opened_mouth(body: Posable, face: BoundFace) -> Table:
    """Fit with closed mouths or with both, and hear the same with the mouth open, elsewhere."""
    data = examples(body, face, SIX, True, "character")
    is_open = np.array([variant.endswith("_open") for variant in data.variants])
    last = np.array([int(r[-1]) >= PERFORMERS // 2 for r in data.recordings])
    table = Table(title="The mouth opens over the expression; fitted on half of the performers")
    for column in ("fitted on", "rules", "published poses recognised", "with an open mouth"):
        table.add_column(column, justify="left" if column == "fitted on" else "right")
    for title, kept in (("published poses", ~is_open & ~last), ("both", ~last)):
        learned = fit_system(data.subset(kept))
        system = learned.system
        cells = []
        for tested in (~is_open, is_open):
            rows = data.subset(tested & last & np.array([bool(e) for e in data.emotions]))
            predicted = classify(evaluate_examples(system, rows), system.emotions)
            right = sum(a == b for a, b in zip(predicted, rows.emotions, strict=True))
            cells.append(f"{right} of {len(predicted)}")
        table.add_row(title, rules_and_fallback(learned), *cells)
    return table


def setup_of(face: BoundFace) -> RetargetSetup:
    """Return how takes are retargeted onto a face."""
    return RetargetSetup(Binding(face.markers, face.vertices), nose_tip=face.nose_tip)


def jitter(data: Examples, face: BoundFace) -> str:
    """Return the outputs on half a minute of noisy markers at rest, through the solve."""
    system = fit_system(data).system
    rng = np.random.default_rng(99)
    at_rest = face.neutral + NOISE * rng.standard_normal((1800, *face.neutral.shape))
    take = MarkerTake(face.markers, np.arange(1800) / RATE, at_rest, RATE)
    face = replace(face, roles=known_roles(face.markers, face.roles))
    setup = replace(setup_of(face), neutral=(0, REST))
    cleaned, weights, solution, _ = clean_and_solve(take, face, setup)
    read = features(system, face, cleaned, weights=weights, solution=solution)
    outputs = evaluate(system.fuzzy, read).outputs
    return (
        f"noisy markers at rest: every emotion at most {outputs.mean(axis=0).max():.4f} in the "
        f"mean, {outputs.max():.3f} in a frame"
    )


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    console = Console(width=None if sys.stdout.isatty() else 170)
    body, mesh = posable_face(SHARED), read_makehuman(SHARED / "makehuman_cc0")[0].face()
    optical = read_bind(ROOT / "tests" / "data" / "animface_ict_bind.json")[0]
    marks = landmarks(SHARED)
    named = tuple(f"landmark_{i}" for i in range(len(marks)))
    bodies = {}
    for title, names, vertices, nose in (
        ("68", named, marks, "landmark_30"),
        ("41", optical.binding.markers, optical.binding.points, optical.nose_tip),
    ):
        points = landmarks_on(body, SHARED, vertices)
        setup = RetargetSetup(Binding(names, points), nose_tip=nose)
        bodies[title] = body, bound_face(mesh, setup)
    console.print(summary(bodies))
    for title, emotions in (("six", SIX), ("twelve", tuple(EMOTIONS))):
        data = examples(*bodies["68"], emotions, False, "character")
        found = cross_validate(data, "recording")
        console.print(confusion(found, f"{title} emotions, 68 markers, new performer"))
        if title == "six":
            system = fit_system(data).system
            for rule in system.fuzzy.rules:
                console.print(f"{rule.text} (weight {rule.weight:g})")
            console.print(jitter(data, bodies["68"][1]))
        apart = separations(data, "recording")
        for each in (f for pair in apart for f in pair.findings()):
            console.print(each.message)
        least = min(apart, key=lambda pair: pair.sensitivity)
        console.print(
            f"least apart: {' and '.join(least.emotions)}, {least.sensitivity:.1f} spreads by "
            f"{least.features[0]}, {least.mistaken} of {least.tested} mistaken"
        )
    data = examples(*bodies["68"], SIX, False, "character")
    console.print(
        confusion(cross_validate(data, "variant"), "six emotions, 68 markers, new variant")
    )
    console.print(opened_mouth(*bodies["68"]))


if __name__ == "__main__":
    main()
