"""One take on three characters: seconds of its clean-up without a cache and with a common one."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.sequence.show import CHARACTERS, make_show
from usdface.io.usd.take_write import write_take
from usdface.pipeline import make_shot, process
from usdface.pipeline.reading import read_take
from usdface.takes import MarkerTake

__all__ = ["run_characters"]

_GAPS = 3  # of each marker, of up to _LONGEST frames, after _REST frames
_LONGEST, _REST = 25, 20
_SPIKE = 0.02  # m


def run_characters(folder: Path, frames: int, workers: int) -> None:
    """Print seconds; the bytes of each result are equal, or an assertion fails."""
    show = make_show(folder / "show", 1, frames, written=False).parent
    take, _ = read_take(show / "takes/shot_000.usdc")
    assert isinstance(take, MarkerTake)
    write_take(_disturbed(take), show / "take.usdc")
    shots = [show / f"shots/character_{number}.usda" for number in range(CHARACTERS)]
    bind = show / "bind.json"
    for shot in shots:
        make_shot(show / f"{shot.stem}.usdc", show / "take.usdc", shot, bind=bind)
    process(shots[0])  # compiles the solver
    for shot in shots:
        spent, made = [], []
        for cache in (None, folder / "cache"):
            result = process(shot, cache=cache)
            spent.append(result.seconds)
            made.append(_digests(shot.with_suffix(".usdface")))
        assert made[0] == made[1]
        before, after = spent
        stages = result.summary["stages"]
        print(
            f"{shot.stem}: clean {before['clean']:.3f} s, with the cache {after['clean']:.3f} s "
            f"({stages['clean']}); solve {before['solve']:.1f} s; the same bytes"
        )
    names = [str(shot) for shot in shots]
    options = ("--workers", str(workers), "--cache", str(folder / "common"))
    subprocess.run([sys.executable, "-m", "usdface", "sequence", *names, *options], check=False)


def _digests(folder: Path) -> dict[str, str]:
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def _disturbed(take: MarkerTake) -> MarkerTake:
    """Return the take with gaps and a spike of each marker."""
    chance = np.random.default_rng(1)
    positions = take.positions.copy()
    for marker in range(positions.shape[1]):
        for _ in range(_GAPS):
            first = int(chance.integers(_REST, len(positions) - _LONGEST))
            positions[first : first + int(chance.integers(2, _LONGEST)), marker] = np.nan
        positions[int(chance.integers(_REST, len(positions))), marker] += _SPIKE
    return replace(take, positions=positions)
