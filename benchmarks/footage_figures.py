"""Figures of the footage code for `benchmarks/sensitivity.py footage`.

A film before a phone on which the detector was built, 45 images with a blink: samples found, label
errors and centres; and names by a binding for 20 other faces.
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "footage")]
from benchmarks.footage.film import PHONE, shoot, temporary_folder  # noqa: E402
from benchmarks.footage.judge import judge  # noqa: E402
from benchmarks.footage.weights import film_of  # noqa: E402
from usdface.errors import InputError  # noqa: E402
from usdface.footage.face_names import pair_with_face  # noqa: E402
from usdface.io.images.footage import read_footage  # noqa: E402
from usdface.options import TakeOptions  # noqa: E402

START, COUNT = 10.0, 45
_FIGURES = ("found %", "wrong labels %", "centre px", "doubts", "confidence")


def figures() -> dict[str, float]:
    """Return what is found, and how exactly."""
    folder = temporary_folder() / f"figures_{START:g}_{COUNT}"
    truth = shoot(film_of(0.0, START, COUNT), PHONE, folder)
    try:
        _, footage, _ = read_footage(folder / "face.####.jpg", TakeOptions(rate=30.0))
    except InputError:
        return dict.fromkeys(_FIGURES, 0.0)
    arrays = {name: getattr(truth, name) for name in ("centroids", "vertices", "shares")}
    score = judge(footage.tracks, arrays)
    return {
        "found %": 100 * score.found,
        "wrong labels %": 100 * (1 - score.labels),
        "centre px": score.centroid_rms,
        "doubts": float(len(footage.tracks.doubts)),
        "confidence": float(footage.tracks.confidence[footage.tracks.confidence > 0].mean()),
    }


def name_figures() -> dict[str, float]:
    """Return the shares of dots that a binding names rightly and wrongly."""
    from test_face_names import bound_points, filmed, performer

    points = bound_points()
    right = wrong = shown = 0
    for seed in range(20):
        random = np.random.default_rng(100 + seed)
        angles = tuple(random.normal(0, [12, 10, 8]))
        seen = random.permutation(len(points))[: len(points) - int(random.integers(0, 6))]
        pairs = pair_with_face(filmed(performer(points, seed), angles)[seen], points)
        own = seen[pairs[pairs >= 0]] == np.flatnonzero(pairs >= 0)
        right, wrong, shown = right + own.sum(), wrong + (~own).sum(), shown + len(seen)
    return {"named %": 100 * float(right) / shown, "misnamed %": 100 * float(wrong) / shown}
