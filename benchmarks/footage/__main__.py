"""Centres, labels and speed of `usdface take` on rendered footage, beside other trackers.

``python -m benchmarks.footage [FOLDER]``; the films are rendered once into FOLDER (three to eight
minutes), by default a folder of temporary files. Curves are those of a real Live Link Face
recording where the shared data are, else the example's performance. The detector was built on the
example's performance; the recording's films are only scored.
"""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.footage import other_trackers
from benchmarks.footage.film import (
    CLEAN,
    PHONE,
    SHARED,
    Film,
    example_film,
    ict_film,
    recorded_curves,
    shoot,
    swaying,
    temporary_folder,
)
from benchmarks.footage.judge import judge
from usdface import make_take
from usdface.io.images.footage import read_footage
from usdface.options import TakeOptions

RATE = 30.0
SECONDS = 4.0


def curves(start: float):
    """Return weights (F, S) and their names: recorded, or of the example."""
    if (SHARED / "livelinkface").is_dir():
        return recorded_curves(SECONDS, RATE, start)
    from examples.performance import perform

    weights = perform().weights
    first = round(start * RATE) % 120
    return weights.weights[::2][first : first + round(SECONDS * RATE)], weights.names


def film(start: float, yaw: float, hand: bool = False) -> Film:
    """Return a film of the example's head."""
    weights, names = curves(start)
    angles, shift = swaying(len(weights), RATE, yaw)
    return example_film(weights, names, angles, shift, hand=hand)


def film_of_ict(start: float, yaw: float) -> Film:
    """Return a film of the ICT face."""
    weights, names = curves(start)
    return ict_film(weights, names, *swaying(len(weights), RATE, yaw))


FILMS: dict[str, tuple[Callable[[], Film], object]] = {
    "clean": (lambda: film(20.0, 20.0), CLEAN),
    "phone": (lambda: film(40.0, 20.0), PHONE),
    "phone, ICT": (lambda: film_of_ict(90.0, 20.0), PHONE),
    "phone, hand": (lambda: film(60.0, 20.0, hand=True), PHONE),
}


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=temporary_folder())
    parser.add_argument("--render-only", action="store_true")
    parser.add_argument("--film", choices=FILMS, action="append", help="only this; may be repeated")
    parsed = parser.parse_args()
    for name in parsed.film or FILMS:
        make, look = FILMS[name]
        folder = parsed.folder / name.replace(", ", "_")
        truth = shoot(make(), look, folder)
        if parsed.render_only:
            continue
        suffix = "jpg" if look.jpeg else "png"
        pattern = folder / f"face.####.{suffix}"
        wall, cpu = time.perf_counter(), time.process_time()
        _, footage, findings = read_footage(pattern, TakeOptions(rate=RATE))
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        count = len(truth.shares)
        print(f"{name}: {judge(footage.tracks, vars_of(truth))}")
        doubts = sum(found.code == "TRACK_DOUBTED" for found in findings)
        print(
            f"  {count / wall:.0f} images/s, {1000 * cpu / count:.0f} ms of CPU time each;", end=""
        )
        print(f" {doubts} stretches doubted; channel {footage.model.channel.name}")
        for line in other_trackers.rows(folder, suffix, truth, footage):
            print("  " + line)
    if not parsed.render_only:
        _whole_command(parsed.folder)
    return 0


def vars_of(truth) -> dict[str, np.ndarray]:
    """Return the arrays of a truth by name."""
    return {name: getattr(truth, name) for name in ("centroids", "vertices", "shares")}


def _whole_command(folder: Path) -> None:
    """Time `usdface take` of a long sequence: the phone's film there and back."""
    links = folder / "long"
    links.mkdir(exist_ok=True)
    images = sorted((folder / "phone").glob("face.*.jpg"))
    for number in range(1200):
        turn = number % (2 * len(images) - 2)
        place = links / f"face.{number + 1:05d}.jpg"
        if not place.exists():
            place.symlink_to(images[min(turn, 2 * len(images) - 2 - turn)])
    wall = time.perf_counter()
    result = make_take(
        links / "face.#####.jpg", folder / "long.usdc", options=TakeOptions(rate=RATE)
    )
    wall = time.perf_counter() - wall
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"usdface take of 1200 images of 1280 x 960 (JPEG): {1200 / wall:.0f} images/s from files "
        f"to take, {result.summary['markers']} markers; peak memory of this process {peak:.0f} MB"
    )


if __name__ == "__main__":
    sys.exit(main())
