"""`usdface sequence` on a made show of 60 shots: ``python -m benchmarks.sequence``.

``speed``: beside single commands, a second run, a changed gain. ``kills``: workers and the parent
at random moments. ``simulate``: 1,000 and 100,000 shots on 1, 10 and 100 workers. ``long``: a
million frames in pieces. ``characters``: one take on three of them, which share its clean-up.
"""

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.sequence.characters import run_characters
from benchmarks.sequence.kills import run_kills
from benchmarks.sequence.long_take import run_long
from benchmarks.sequence.show import make_show
from benchmarks.sequence.simulation import print_simulation

USDFACE = [sys.executable, "-m", "usdface"]


def sequence(show: Path, *options: str) -> tuple[float, dict[str, Any]]:
    """Run the command; return its wall time [s] and its report."""
    report = show.parent / "report.json"
    begin = time.perf_counter()
    command = [*USDFACE, "sequence", str(show), "--report", str(report), *options]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin, json.loads(report.read_text())


@dataclass
class Spent:
    """Wall time and processor time [s] of child processes."""

    wall: float = 0.0
    worked: float = 0.0

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Add the times of a block."""
        wall, worked = time.perf_counter(), _worked()
        yield
        self.wall += time.perf_counter() - wall
        self.worked += _worked() - worked

    def __str__(self) -> str:
        return f"{self.wall:8.1f} s ({self.worked:.0f} s of processor time)"


def _worked() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def speed(shots: int, frames: int, workers: int, singles: int) -> None:
    """Print wall times; the two ways alternate, so that other work falls on both alike."""
    with tempfile.TemporaryDirectory() as name:
        show = make_show(Path(name) / "show", shots, frames)
        files = sorted((show.parent / "shots").glob("*.usda"))
        alone, together = Spent(), Spent()
        size = max(1, singles // 2)
        for first in range(0, singles, size):
            last = min(first + size, singles) - 1
            with alone.measured():
                for file in files[first : last + 1]:
                    command = [*USDFACE, "process", str(file), "-o", f"{name}/alone/{file.name}"]
                    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            with together.measured():
                sequence(show, "--workers", str(workers), "--index", f"{first}-{last}")
        share = together.wall / alone.wall
        print(f"{shots} shots of {frames} frames, {workers} workers")
        print(f"{singles} single commands    {alone}")
        print(f"the same in a sequence{together}, {share:.2f} of that")
        with together.measured():
            sequence(show, "--workers", str(workers))
        print(f"all {shots} in a sequence  {together}")
        again, report = sequence(show)
        assert report["summary"]["kept"] == shots
        share = again / together.wall
        print(f"again, nothing new    {again:8.2f} s, {share:.1%} of the first run")
        for file in files:
            text = file.read_text()
            file.write_text(
                text.replace("float usdface:gain = 1\n", "float usdface:gain = 0.9\n", 1)
            )
        seconds, report = sequence(show, "--workers", str(workers))
        stages = [tuple(row["stages"].values()) for row in report["shots"]]
        assert stages == [("cached", "computed")] * shots, stages
        share = seconds / together.wall
        print(f"a gain of each changed{seconds:8.1f} s, {share:.0%}; no solve of {shots} ran again")
        peaks = [row["peak_memory_mb"] for row in report["shots"]]
        print(f"memory of a worker    {max(peaks):8.0f} MB, or less")
        mean = sum(row["seconds"] for row in report["shots"]) / shots
        print(f"a changed gain, a shot{mean:8.2f} s in its worker")


def main() -> None:
    """Run a part."""
    parser = argparse.ArgumentParser()
    parser.add_argument("part", choices=("speed", "kills", "simulate", "long", "characters"))
    parser.add_argument("--shots", type=int, default=60)
    parser.add_argument("--frames", type=int, help="of a shot (120), of the long take (a million)")
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--singles", type=int, default=0, help="single commands (default: all)")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="for the kills")
    parser.add_argument("--seed", type=int, default=1)
    parsed = parser.parse_args()
    if parsed.part == "speed":
        speed(parsed.shots, parsed.frames or 120, parsed.workers, parsed.singles or parsed.shots)
    elif parsed.part == "long":
        with tempfile.TemporaryDirectory() as name:
            run_long(Path(name), parsed.frames or 1_000_000, parsed.workers)
    elif parsed.part == "characters":
        with tempfile.TemporaryDirectory() as name:
            run_characters(Path(name), parsed.frames or 600, parsed.workers)
    elif parsed.part == "kills":
        folder = Path(tempfile.mkdtemp())
        try:
            run_kills(folder, parsed.kills, parsed.seed, parsed.seconds)
        finally:
            shutil.rmtree(folder)
    else:
        print_simulation()


if __name__ == "__main__":
    main()
