"""Expressions as people and artists draw them: `python benchmarks/drawn_expressions.py`.

Those of `usdface.face.drawn_expressions`, shown by the ICT face in one take, with 0.3 mm of noise
and a solve, to five layouts of markers on three characters. Each is judged without the drawings of
its own source and without what the ICT face does in the table of face motion, so that every source
and the performer are unknown to the layer. See README.md.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]
from expression_takes import DETECTED, NOISE, REST, SHARED, course  # noqa: E402
from faces import RATE, Face, make_face  # noqa: E402

from usdface.arrays import FloatArray  # noqa: E402
from usdface.correction import expression_classifier  # noqa: E402
from usdface.correction.expression_classifier import ExpressionClassifier  # noqa: E402
from usdface.correction.expression_layer import express  # noqa: E402
from usdface.correction.feature_extraction import sided_features  # noqa: E402
from usdface.face.drawn_expressions import DRAWN  # noqa: E402
from usdface.face.expression_variants import Variant, expression_variants  # noqa: E402
from usdface.face.face_motion import face_motion  # noqa: E402
from usdface.face.marker_surface import MarkerSurface  # noqa: E402
from usdface.retarget.bound_points import BoundPoints  # noqa: E402
from usdface.retarget.solve_take import Solution, solve_take  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

FACES = ("ict68", "ict41", "makehuman68", "makehuman41", "example68")
COURSE = course(0.4, gap=0.3, rise=0.3)
HELD = np.flatnonzero(COURSE >= 1 - 1e-9)


def performance(face: Face, shown: FloatArray, performer: Face) -> tuple[MarkerTake, Solution]:
    """Record what the performer's markers do while each row of weights is shown; solve it."""
    index = {name: i for i, name in enumerate(performer.setup.binding.markers)}
    names = face.setup.binding.markers
    weights = np.concatenate(
        [np.zeros((REST, shown.shape[1])), *(COURSE[:, None] * shown[:, None])]
    )
    positions = performer.markers(weights)[:, [index[name] for name in names]]
    positions = positions + NOISE * np.random.default_rng(0).standard_normal(positions.shape)
    take = MarkerTake(names, np.arange(len(positions)) / RATE, positions, RATE)
    points, mesh = face.setup.binding.points, face.mesh
    solution, _ = solve_take(
        take,
        BoundPoints.linear(mesh.points[points], mesh.offsets_at(points), mesh.shape_names),
        face.setup,
        surface=MarkerSurface(mesh, points),
    )
    return take, solution


def judged(face: Face, take: MarkerTake, solution: Solution, source: str) -> FloatArray:
    """Return the output of each expression without the drawings of a source: (N, E)."""
    others = tuple(name for name in DRAWN if name != source)
    rigs = tuple(name for name in face_motion().rigs if name != "ICT")
    unseen = partial(ExpressionClassifier, drawn=others, rigs=rigs)
    with patch.object(expression_classifier, "ExpressionClassifier", unseen):
        features = sided_features(
            face.system,
            face.bound,
            take,
            weights=solution.weights,
            solution=solution,
            expressions=face.expressions,
        )
    said = express(
        face.system,
        features,
        face.bound,
        names=solution.weights.names,
        weights=solution.weights.weights,
        expressions=face.expressions,
        times=take.times,
    )
    outputs = np.stack([said.trace.emotions[e.name] for e in face.expressions], axis=1)
    return outputs[REST:].reshape(-1, len(COURSE), outputs.shape[1])[:, HELD].mean(axis=1)


def counted(face: Face, shown: list[Variant], outputs: FloatArray) -> tuple[np.ndarray, list[str]]:
    """Return how many are right, missed and wrong, and the wrong ones."""
    counts, wrong = np.zeros(3, dtype=int), []
    names = [e.name for e in face.expressions]
    for variant, output in zip(shown, outputs, strict=True):
        loudest = names[int(output.argmax())]
        if output.max() < DETECTED:
            counts[1] += 1
        elif loudest == variant.emotion:
            counts[0] += 1
        else:
            counts[2] += 1
            wrong.append(f"{variant.emotion}: {loudest}")
    return counts, wrong


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", nargs="+", choices=FACES, default=FACES)
    kinds = parser.parse_args().faces
    table = Table(title="Drawn expressions: right, missed, wrong")
    for column in ("face", *DRAWN, "all", "wrong ones"):
        table.add_column(column)
    for kind in kinds:
        face = make_face(kind, SHARED)
        performer = make_face("ict68" if kind.endswith("68") else "ict41", SHARED)
        known = expression_variants(performer.expressions, performer.mesh.shape_names)
        shown = [variant for variant in known if variant.source in DRAWN]
        take, solution = performance(face, np.array([v.weights for v in shown]), performer)
        cells, total, all_wrong = [], np.zeros(3, dtype=int), []
        for source in DRAWN:
            own = [i for i, variant in enumerate(shown) if variant.source == source]
            outputs = judged(face, take, solution, source)[own]
            counts, wrong = counted(face, [shown[i] for i in own], outputs)
            cells.append(", ".join(map(str, counts)))
            total, all_wrong = total + counts, all_wrong + wrong
        which = [f"{all_wrong.count(each)} {each}" for each in dict.fromkeys(all_wrong)]
        table.add_row(kind, *cells, ", ".join(map(str, total)), "; ".join(which))
    Console(width=None if sys.stdout.isatty() else 200).print(table)


if __name__ == "__main__":
    main()
