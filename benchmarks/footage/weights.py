"""Weights from the images of a film, beside those from the true projections of its markers.

    python -m benchmarks.footage.weights [FOLDER] [--start 40 50]

The example's head is filmed for three seconds, half of one at rest: once it stays as it is, once it
turns by 20 degrees to either side. Every take goes through files: `usdface take` with the names of
the dots of the first image (clicked to a whole pixel) and the focal length, `shot`, `process`; each
row has the same markers. Films from several places of the recording are pooled at the end (root of
the mean square of their errors), which judges what a turn of the head and the images cost. Curves
are those of a real recording where the shared data are, else the example's performance.
"""

import argparse
import csv
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import usdface
from benchmarks.footage.film import (
    CLEAN,
    PHONE,
    ROOT,
    SHARED,
    Film,
    Look,
    Truth,
    example_film,
    recorded_curves,
    shoot,
    swaying,
    temporary_folder,
)
from usdface.face.curve_mapping import rename_weights
from usdface.io.usd.take_write import write_take
from usdface.takes import MarkerTake, WeightsTake

RATE, FRAMES, REST, SWING = 30.0, 90, 15, 20.0
SIZE = (960, 720)
START = 40.0  # s of the recording
SEEN = 0.5  # least visible share of a dot that counts as seen
LOOKS = {"clean": CLEAN, "phone": PHONE}
# Equations 5 to 10 of the RBF paper: its kernel, and the least spacing of the dots as radius.
PAPER = {"map": {"form": "paper", "kernel": "multiquadric"}}
HEAD = ROOT / "examples" / "head.usdc"
# Weight errors of films, by look and take, then by whether the head turns.
Errors = dict[tuple[str, str], dict[bool, list[float]]]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=temporary_folder() / "weights")
    parser.add_argument(
        "--start", type=float, nargs="+", default=[START], help="of the recording [s]"
    )
    parser.add_argument("--look", choices=LOOKS, action="append", help="only this; may be repeated")
    parsed = parser.parse_args()
    print("| film | from [s] | head | take | weight RMS error | without gaze | skin [mm] |")
    print("|---|---|---|---|---|---|---|")
    errors: Errors = {}
    for look in parsed.look or LOOKS:
        for start in parsed.start:
            for swing in (0.0, SWING):
                film = film_of(swing, start)
                folder = parsed.folder / f"{look}_{swing:g}_{start:g}"
                truth = shoot(film, LOOKS[look], folder)
                head = f"turns by {swing:g} degrees" if swing else "rests"
                for title, *figures in rows(film, truth, LOOKS[look], folder):
                    numbers = "{:.4f} | {:.4f} | {:.2f}".format(*figures)
                    print(f"| {look} | {start:g} | {head} | {title} | {numbers} |", flush=True)
                    errors.setdefault((look, title), {}).setdefault(bool(swing), []).append(
                        figures[0]
                    )
    if len(parsed.start) > 1:
        print_pooled(errors)


def print_pooled(errors: Errors) -> None:
    """Print the errors of all films of a look together."""
    print("\n| film | take | rests | by the first | turns | by the first | turns by rests |")
    print("|---|---|---|---|---|---|---|")
    first: dict[str, tuple[float, float]] = {}
    for (look, title), found in errors.items():
        still, turning = rms(np.array(found[False])), rms(np.array(found[True]))
        by = first.setdefault(look, (still, turning))
        print(
            f"| {look} | {title} | {still:.4f} | {still / by[0]:.2f} | "
            f"{turning:.4f} | {turning / by[1]:.2f} | {turning / still:.2f} |"
        )


def film_of(
    swing: float, start: float = START, count: int = FRAMES, size: tuple[int, int] = SIZE
) -> Film:
    """Return a film of the example's head that turns to either side [degrees] after it rested."""
    shapes = usdface.read_rig(HEAD)[0].mesh("head").shape_names
    grows = np.clip((np.arange(count) - REST) / 15.0, 0.0, 1.0)[:, None]
    weights = grows * curves(shapes, start, count)
    angles, shift = (grows * bool(swing) * values for values in swaying(count, RATE, swing))
    return example_film(weights, shapes, angles, shift, size=size, rate=RATE)


def curves(shapes: tuple[str, ...], start: float, count: int) -> np.ndarray:
    """Return weights (F, S) of blend shapes: recorded, or of the example's performance."""
    if (SHARED / "livelinkface").is_dir():
        weights, names = recorded_curves(count / RATE, RATE, start)
        take = WeightsTake(names, np.arange(count) / RATE, weights, RATE)
        return rename_weights(take, shapes)[0].weights
    from examples.performance import perform

    performed = perform().weights.reordered(shapes).weights[60::2]
    return performed[:count]


def rows(
    film: Film, truth: Truth, look: Look, folder: Path
) -> Iterator[tuple[str, float, float, float]]:
    """Yield each take of a film with the RMS error of weights, of those without gaze, of skin."""
    suffix = "jpg" if look.jpeg else "png"
    clicks = folder / "names.csv"
    named = write_clicks(truth, clicks)
    images = usdface.make_take(
        folder / f"face.####.{suffix}",
        folder / "images.usdc",
        options=usdface.TakeOptions(rate=RATE, focal_length=film.camera.focal, names=clicks),
    ).value
    assert isinstance(images, MarkerTake)
    found = np.zeros(truth.shares.shape, dtype=bool)
    for column, name in enumerate(truth.names):
        if name in images.names:
            track = images.positions[:, images.names.index(name), 0]
            found[:, column] = ~np.isnan(track)
    kept = tuple(name for name in named if name in images.names)
    seen = truth.shares >= SEEN
    spread = noise_of(images, truth)
    noise = spread * np.random.default_rng(0).standard_normal(truth.vertices.shape)
    given = {
        "true projections of the dots that are seen": (truth.vertices, seen),
        "those of the samples that are found": (truth.vertices, found),
        "the same with as much white noise as the images": (truth.vertices + noise, found),
        "true centres of these dots": (truth.centroids, found & (truth.shares > 0)),
    }
    takes: list[tuple[str, Path, dict[str, Any]]] = []
    for number, (title, (places, there)) in enumerate(given.items()):
        path = folder / f"true_{number}.usdc"
        dots = images if places is truth.centroids else None
        write_true_take(film, np.where(there[..., None], places, np.nan), path, dots)
        takes.append((title, path, {}))
    path = folder / "images.usdc"
    takes.append(("**images**", path, {}))
    takes.append(("images by the RBF paper's map", path, PAPER))
    for title, path, settings in takes:
        off = solved_weights(film, kept, path, settings)[REST:] - film.weights[REST:]
        yield title, rms(off), rms(off[:, ~gaze(film)]), skin_error(film, off)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def gaze(film: Film) -> np.ndarray:
    """Return which shapes (S,) turn the eyes, of which dots show only how the lids follow."""
    return np.array([name.startswith("eyeLook") for name in film.shapes])


def noise_of(images: MarkerTake, truth: Truth) -> float:
    """Return the RMS deviation [px] of the centres of seen dots about each one's mean error."""
    error = [
        np.where(
            truth.shares[:, column, None] >= SEEN,
            images.positions[:, images.names.index(name)] * [1, -1] - truth.centroids[:, column],
            np.nan,
        )
        for column, name in enumerate(truth.names)
        if name in images.names
    ]
    off = np.stack(error, axis=1)
    return float(np.sqrt(np.nanmean((off - np.nanmean(off, axis=0)) ** 2)))


def write_clicks(truth: Truth, path: Path) -> tuple[str, ...]:
    """Write the names of the dots of the first image, at whole pixels, and return them."""
    seen = np.flatnonzero(truth.shares[0] >= SEEN).tolist()
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["name", "x", "y"])
        for dot in seen:
            writer.writerow([truth.names[dot], *np.rint(truth.centroids[0, dot]).astype(int)])
    return tuple(truth.names[dot] for dot in seen)


def write_true_take(
    film: Film, places: np.ndarray, path: Path, dots: MarkerTake | None = None
) -> None:
    """Write a take of places (F, M, 2) [px]: of projected vertices, or of the middles of `dots`."""
    table = path.with_suffix(".csv")
    with table.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *(f"{name}_{axis}" for name in film.names for axis in "xy")])
        for frame, row in enumerate(places.reshape(len(places), -1)):
            cells = ["" if np.isnan(value) else f"{value:.6f}" for value in row]
            writer.writerow([f"{frame / film.rate:.9f}", *cells])
    options = usdface.TakeOptions(
        rate=film.rate, dimension=2, image_size=film.camera.size, focal_length=film.camera.focal
    )
    usdface.make_take(table, path, options=options)
    if dots is not None and dots.diameters is not None:
        take = usdface.read_take(path)[0]
        assert isinstance(take, MarkerTake)
        usual = np.full(len(take.names), float(np.median(dots.diameters)))
        write_take(replace(take, diameters=usual), path)


def solved_weights(
    film: Film, names: tuple[str, ...], take: Path, settings: dict[str, Any]
) -> np.ndarray:
    """Return the weights (F, S) that `process` solves from a take of named markers."""
    vertex_of = dict(zip(film.names, film.vertices.tolist(), strict=True))
    bind = take.with_name("bind.json")
    document = {
        "mesh": "head",
        "markers": {name: {"point": vertex_of[name]} for name in names},
        "nose_tip": "nose_tip",
        "neutral": {"start": 0, "end": REST - 1},
    }
    bind.write_text(json.dumps(document | settings))
    shot = take.with_name(f"{take.stem}_shot.usda")
    usdface.make_shot(HEAD, take, shot, bind=bind, overwrite=True)
    result = usdface.process(shot, options=usdface.ProcessOptions(express=False))
    return np.asarray(result.value.solved.reordered(film.shapes).weights)


def skin_error(film: Film, off: np.ndarray) -> float:
    """Return the RMS distance [mm] of the skin by weights that are off by `off` (F, S)."""
    mesh = usdface.read_rig(HEAD)[0].mesh("head")
    moved = mesh.offsets_at(np.arange(len(mesh.points))).reshape(len(film.shapes), -1)
    squares = ((off @ (moved @ moved.T)) * off).sum(axis=1) / len(mesh.points)
    return 1000 * float(np.sqrt(squares.mean()))


if __name__ == "__main__":
    main()
