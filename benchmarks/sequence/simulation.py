"""Scheduling by simulation: shots of estimated times on many workers.

A worker starts (`START`), then takes the next shot of the list as soon as it is done with one. The
parent looks at each shot's files first (`LOOK`) and passes tasks on (`PASS`), one at a time. On a
farm, each task of some shots starts a session and a program of its own (`SESSION`).
"""

import heapq

import numpy as np

__all__ = ["print_simulation"]

# Estimates for idle cores, after runs of `speed` and `openjd run` on busy ones: seconds.
SHOT_MEDIAN, SHOT_SPREAD = 2.6, 0.7  # of takes from some seconds to a minute: a log-normal
START = 1.6  # a worker imports and compiles
LOOK = 0.0025  # the parent: a shot's key, hashed content included
PASS = 0.0004  # the parent: a task to a worker, its row back
SESSION = 0.4  # OpenJD: a session; the program's own start is START


def simulate(shots: int, workers: int, seed: int = 0) -> tuple[float, float, float]:
    """Return wall time [s], the share of time in which workers work, and the parent's share."""
    chance = np.random.default_rng(seed)
    times = SHOT_MEDIAN * np.exp(SHOT_SPREAD * chance.standard_normal(shots))
    looked = shots * LOOK
    free = [(looked + START, k) for k in range(min(workers, shots))]
    heapq.heapify(free)
    parent = looked
    end = 0.0
    for seconds in times:
        at, worker = heapq.heappop(free)
        parent = max(parent, at) + PASS
        done = parent + seconds
        end = max(end, done)
        heapq.heappush(free, (done, worker))
    busy = float(times.sum()) / (end * min(workers, shots))
    return end, busy, (looked + shots * PASS) / end


def farm(shots: int, workers: int, chunk: int, seed: int = 0) -> float:
    """Return the wall time [s] of a farm whose tasks are chunks of shots."""
    chance = np.random.default_rng(seed)
    times = SHOT_MEDIAN * np.exp(SHOT_SPREAD * chance.standard_normal(shots))
    free = [0.0] * min(workers, -(-shots // chunk))
    for first in range(0, shots, chunk):
        at = heapq.heappop(free)
        heapq.heappush(free, at + SESSION + START + times[first : first + chunk].sum())
    return max(free) + SESSION + shots * LOOK  # the table at the end


def print_simulation() -> None:
    """Print the tables."""
    print("shots    workers   wall time   workers busy   parent busy")
    for shots in (1_000, 100_000):
        for workers in (1, 10, 100):
            wall, busy, parent = simulate(shots, workers)
            print(f"{shots:7,} {workers:9} {_text(wall):>11} {busy:14.1%} {parent:13.1%}")
    print("\nfarm: shots, workers, wall time in chunks of 1, 10, 100")
    for shots in (1_000, 100_000):
        for workers in (10, 100):
            walls = ", ".join(_text(farm(shots, workers, chunk)) for chunk in (1, 10, 100))
            print(f"{shots:7,} {workers:9}   {walls}")


def _text(seconds: float) -> str:
    return f"{seconds / 3600:.1f} h" if seconds > 5400 else f"{seconds / 60:.1f} min"
