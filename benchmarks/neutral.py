"""Neutral frames that are looked for: `python benchmarks/neutral.py`.

Performers as those of `binding.py`, with places that are known, play parts of recorded curves. In
most takes they rest for half a second, at the start, in the middle or at the end; in the last kind
as recorded. A figure is the RMS of the true weights in the frames that are taken as neutral, before
those that are estimated there are taken off. `--held-out` plays other parts by other performers,
which no setting was chosen on. `--film`: the same through one camera of unknown focal length, 0.7 m
away, with 0.35 px of noise. See README.md.
"""

import argparse
import sys
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]
from binding import KINDS, SHARED, acted, every_frame, performed  # noqa: E402
from faces import Face, make_face  # noqa: E402

from usdface.arrays import FloatArray  # noqa: E402
from usdface.binding.bound_neutral import bound_neutral  # noqa: E402
from usdface.face.bound_face import BoundFace  # noqa: E402
from usdface.retarget.film.one_camera import PinholeCamera  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

# Curves that hold something all the time, as recorded; or all shapes come down to 0 at times.
CURVES = ("as recorded", "lowered")
LOWEST = 0.15  # quantile that is lowered to 0
# Where the performer rests.
RESTS = ("start", "after a smile", "middle", "end", "nowhere")
REST, FADE, LENGTH = 0.5, 0.3, 30.0  # s
# Start of each part [s], and the seeds of performers.
BUILT_WITH, HELD_OUT = ((0.0, 60.0), (21, 22)), ((30.0, 90.0), (31, 32, 33))
# A rest was found where the RMS of the weights is below this.
FOUND = 0.02
SMILE = 2.0  # s
IMAGE, LENS, DISTANCE, BLUR = (1280, 960), 1100.0, 0.7, 0.35  # px, px, m, px


def with_rest(weights: FloatArray, rate: float, kind: str, smile: FloatArray) -> FloatArray:
    """Return weights (F, S) with a rest, faded in and out; `smile` (S,) is held before one kind."""
    if kind == "nowhere":
        return weights
    frames, fade = round(REST * rate), round(FADE * rate)
    middle = {"start": 0, "after a smile": 0, "middle": len(weights) // 2, "end": len(weights)}
    before, after = weights[: middle[kind]], weights[middle[kind] :]
    if kind == "after a smile":
        before = np.repeat(smile[None], round(SMILE * rate), axis=0)
    share = (0.5 - 0.5 * np.cos(np.pi * np.arange(1, fade + 1) / (fade + 1)))[:, None]
    parts = [before]
    if len(before):
        parts.append((1.0 - share) * before[-1])
    parts.append(np.zeros((frames, weights.shape[1])))
    if len(after):
        parts.append(share * after[0])
    return np.concatenate([*parts, after])


def smile_of(face: Face) -> FloatArray:
    """Return the weights (S,) of half a smile."""
    names = [expression.name for expression in face.expressions]
    return np.asarray(0.5 * face.poses[names.index("joy")])


def filmed(face: Face, seed: int, weights: FloatArray, rate: float) -> MarkerTake:
    """Return the take of a performer before a camera whose focal length is not told."""
    rng = np.random.default_rng(seed)
    times, positions = acted(face, rng, seed, weights, rate)
    before = positions - positions[0].mean(axis=0) - [0.0, 0.0, DISTANCE]
    image = PinholeCamera(LENS, 0.5 * np.array(IMAGE) * [1.0, -1.0]).image(before)
    image += BLUR * rng.normal(size=image.shape)
    names = face.setup.binding.markers
    return MarkerTake(names, times, image, rate, image_size=IMAGE, source="film")


def shown(kind: str, curve: str, rest: str, start: float, seed: int, film: bool) -> float:
    """Return the RMS of the weights in the frames that are found in one take."""
    face = make_face(kind, SHARED)
    curves, rate = every_frame(face)
    if curve == "lowered":
        low = np.quantile(curves, LOWEST, axis=0)
        curves = ((curves - low) / (1.0 - low)).clip(0.0, 1.0)
    first = round(start * rate)
    part = curves[first : first + round(LENGTH * rate)]
    weights = with_rest(part, rate, rest, smile_of(face))
    if film:
        take, points = filmed(face, seed, weights, rate), face.setup.binding.points
    else:
        case = performed(kind, seed, weights, rate)
        take, points = case.take, case.truth
    found = bound_neutral(take, BoundFace(face.mesh, take.names, points))
    return float(np.sqrt((weights[found[0] : found[1] + 1].mean(axis=0) ** 2).mean()))


def figures(held_out: bool, film: bool) -> dict[tuple[str, str, str], list[float]]:
    starts, seeds = HELD_OUT if held_out else BUILT_WITH
    found: dict[tuple[str, str, str], list[float]] = {}
    worlds = [*product(KINDS, CURVES, RESTS, starts, seeds)]
    for kind, curve, rest, start, seed in track(worlds, "takes", transient=True):
        value = shown(kind, curve, rest, start, seed, film)
        found.setdefault((kind, curve, rest), []).append(value)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--film", action="store_true")
    parsed = parser.parse_args()
    found = figures(parsed.held_out, parsed.film)
    table = Table(title="RMS of the weights in the neutral frames: median, largest; rests found")
    for column in ("face", "curves", *RESTS):
        table.add_column(column, justify="right")
    for kind, curve in product(KINDS, CURVES):
        row = []
        for rest in RESTS:
            values = np.array(found[kind, curve, rest])
            text = f"{np.median(values):.3f}, {values.max():.3f}"
            if rest != "nowhere":
                text += f"; {(values < FOUND).sum()} of {len(values)}"
            row.append(text)
        table.add_row(kind, curve, *row)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
