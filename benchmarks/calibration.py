"""Weight error with and without a calibration: `python benchmarks/calibration.py`.

Performers are the ICT face bent at random, each shape 0.8 to 1.25 as strong, 68 landmarks, 0.3 mm
of noise; the character is the ICT face. They are calibrated on the first half of the recorded
curves and scored on the other, with and without. See README.md.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from benchmarks.performers.worlds import to_extremes  # noqa: E402
from benchmarks.solve.faces import Face, bent, ict  # noqa: E402
from usdface.arrays import FloatArray  # noqa: E402
from usdface.face.bound_face import bound_face  # noqa: E402
from usdface.retarget_take.calibrate import calibrate  # noqa: E402
from usdface.retarget_take.clean_and_solve import clean_and_solve  # noqa: E402
from usdface.setup.binding import Binding  # noqa: E402
from usdface.setup.calibration import Calibration  # noqa: E402
from usdface.setup.retarget_setup import RetargetSetup  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

SHARED = ROOT.parent / "shared" / "data"
REST, NOISE, SIZE = 15, 3e-4, 1.1
BEND = 0.004
PERFORMERS = 4
TRAINED, SCORED = slice(0, 2015), slice(2015, 4030)


def performance(
    face: Face, performer: Face, gains: FloatArray, weights: FloatArray, seed: int
) -> MarkerTake:
    moves = (gains[:, None, None] * performer.offsets).reshape(len(gains), -1)
    played = np.concatenate([np.zeros((REST, len(gains))), weights])
    places = performer.neutral + (played @ moves).reshape(len(played), *performer.neutral.shape)
    places = SIZE * places + NOISE * np.random.default_rng(seed).standard_normal(places.shape)
    return MarkerTake(face.names, np.arange(len(places)) / face.rate, places, face.rate)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def figures() -> dict[str, float]:
    """Return the RMS error of gains that one performer's range of motion tells."""
    face = ict(SHARED)
    names, curves = face.mesh.shape_names, to_extremes(face.curves[TRAINED])
    setup = RetargetSetup(
        Binding(face.names, face.points),
        head="stabilised",
        neutral=(0, REST - 1),
        nose_tip=face.names[30],
    )
    gains = np.random.default_rng(108).uniform(0.8, 1.25, len(names))
    take = performance(face, bent(face, 8, BEND), gains, curves[::4], 58)
    found, _ = calibrate(take, bound_face(face.mesh, setup), setup, extremes=True)
    off = found.calibration.gains - gains
    known = [names.index(shape) for shape in found.known]
    return {
        "gains": rms(off),
        "of known": rms(off[known]) if known else np.nan,
        "known": float(len(known)),
        "offsets": rms(found.calibration.offsets),
    }


def main() -> None:
    face = ict(SHARED)
    names, curves = face.mesh.shape_names, face.curves.clip(0, 1)
    setup = RetargetSetup(
        Binding(face.names, face.points),
        head="stabilised",
        neutral=(0, REST - 1),
        nose_tip=face.names[30],
    )
    trained = {
        "range of motion, --extremes": (to_extremes(curves[TRAINED]), True),
        "recorded, without": (curves[TRAINED], False),
        "recorded, --extremes (wrong)": (curves[TRAINED], True),
    }
    table = Table(title=f"weight RMS error on the other half, mean of {PERFORMERS} performers")
    for column in ("performer", "calibrated on", "before", "after", "gains known exactly"):
        table.add_column(column)
    for column in ("gain RMS error before", "after", "of known", "known"):
        table.add_column(column)
    for kind in ("gains of 0.8 to 1.25", "as strong as the character"):
        rows: dict[str, list[list[float]]] = {name: [] for name in trained}
        for seed in range(PERFORMERS):
            drawn = np.random.default_rng(100 + seed).uniform(0.8, 1.25, len(names))
            gains = drawn if kind.startswith("gains") else np.ones(len(names))
            performer = bent(face, seed, BEND)
            scored = performance(face, performer, gains, curves[SCORED], seed)

            def error(calibration: Calibration | None, take: MarkerTake = scored) -> float:
                calibrated = replace(setup, calibration=calibration)
                _, solved, _, _ = clean_and_solve(
                    take, bound_face(face.mesh, calibrated), calibrated
                )
                return rms(solved.weights[REST:] - curves[SCORED])

            before = error(None)
            exact = error(Calibration(names, gains, np.zeros(len(names))))
            for name, (weights, extremes) in trained.items():
                take = performance(face, performer, gains, weights, 50 + seed)
                found, _ = calibrate(take, bound_face(face.mesh, setup), setup, extremes=extremes)
                off = found.calibration.gains - gains
                known = [names.index(shape) for shape in found.known]
                of_known = rms(off[known]) if known else np.nan
                errors = before, error(found.calibration), exact
                rows[name].append([*errors, rms(gains - 1), rms(off), of_known, len(known)])
        for name, each in rows.items():
            mean = np.nanmean(each, axis=0) if not np.isnan(each).all(axis=0).any() else None
            values = mean if mean is not None else np.nan_to_num(np.mean(each, axis=0))
            cells = [f"{value:.4f}" for value in values[:3]] + [f"{v:.3f}" for v in values[3:6]]
            table.add_row(kind, name, *cells, f"{values[6]:.0f} of {len(names)}")
    Console(width=170).print(table)


if __name__ == "__main__":
    main()
