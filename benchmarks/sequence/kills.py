"""SIGKILL of a sequence's workers and parent at random moments, and a look at what is left."""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from pxr import Usd

from benchmarks.sequence.show import make_show

__all__ = ["run_kills"]

_SHOTS, _FRAMES = 3, 40
# By which the time in which runs are killed grows with each hit, so that late moments come.
_LONGER = 1.1
# Files are opened at once, not in a process with limits first: that takes longer than a shot here.
_ENVIRONMENT = {**os.environ, "USDFACE_TRUSTED": "1"}


def run_kills(folder: Path, kills: int, seed: int, seconds: float) -> None:
    """Kill runs that are at work until so many were hit, or the time is up; print what was found.

    Parent and workers take turns, each at a random moment between the first shot that is begun and
    the end of an undisturbed run. After each kill every result that is there must open as a whole,
    and be the old or the new one; the next run must complete, with the bytes of a run that nobody
    disturbed. Every run begins from a changed gain, so that there is an earlier result to lose;
    every third has no cache, so that a solve is killed.
    """
    show = make_show(folder / "show", _SHOTS, _FRAMES)
    chance = random.Random(seed)
    shots = sorted((show.parent / "shots").glob("*.usda"))
    finish(show)
    generations = [results(shots)]
    set_gain(shots, 1)
    finish(show)
    generations.append(results(shots))
    lasting = {}
    for cached in (True, False):
        set_gain(shots, 0)
        finish(show)
        set_gain(shots, 1)
        lasting[cached] = work_of(show, shots, cached)
    found: Counter[str] = Counter()
    end = time.monotonic() + seconds
    number = done = 0
    while done < kills and time.monotonic() < end:
        number += 1
        generation = number % 2
        set_gain(shots, generation)
        cached = number % 3 != 0
        if not cached:
            forget(shots)
        victim = "parent" if (number // 2) % 2 else "worker"
        hit, status, worked = kill(show, victim, chance.random() * lasting[cached], chance)
        if not hit:
            found["run that ended before its kill"] += 1
            # It was quicker than the last: the machine does other things at times.
            lasting[cached] = min(lasting[cached], worked)
            continue
        lasting[cached] *= _LONGER
        done += 1
        found[f"{victim} killed, exit {status}"] += 1
        old, new = generations[1 - generation], generations[generation]
        for shot, before, after in zip(shots, old, new, strict=True):
            found[f"result {state(shot, before, after)}"] += 1
        finish(show)
        same = results(shots) == generations[generation]
        found["next run complete" if same else "NEXT RUN WRONG"] += 1
        litter = [p for p in show.parent.rglob(".usdface-*")]
        found["LITTER"] += bool(litter)
    print(
        f"{done:6} kills; a run works for {lasting[True]:.1f} s, "
        f"without cache {lasting[False]:.1f} s"
    )
    for what, count in sorted(found.items()):
        print(f"{count:6} {what}")


def forget(shots: list[Path]) -> None:
    """Remove the caches: the next run solves again."""
    for shot in shots:
        for file in (folder_of(shot) / "cache").glob("*"):
            file.unlink()


def work_of(show: Path, shots: list[Path], cached: bool) -> float:
    """Return how long an undisturbed run works after its first shot is begun [s]."""
    if not cached:
        forget(shots)
    run = start(show)
    begun(run)
    begin = time.perf_counter()
    assert run.wait(600) == 0
    return time.perf_counter() - begin


def begun(run: "subprocess.Popen[str]") -> None:
    """Wait until a run has begun its first shot."""
    assert run.stderr is not None
    for line in run.stderr:
        if "shot_" in line:
            break
    threading.Thread(target=run.stderr.read, daemon=True).start()  # so that the pipe never fills


def set_gain(shots: list[Path], generation: int) -> None:
    """Write the gain of a generation into the shots."""
    values = ("float usdface:gain = 1\n", "float usdface:gain = 0.5\n")
    for shot in shots:
        text = shot.read_text()
        wanted = text.replace(values[1 - generation], values[generation], 1)
        if values[generation] not in text.replace(values[1 - generation], "", 1) or wanted != text:
            shot.write_text(wanted)


def start(show: Path, workers: int = 2) -> "subprocess.Popen[str]":
    """Start a sequence with some workers, which says what it does."""
    command = [sys.executable, "-m", "usdface", "sequence", str(show), "--workers", str(workers)]
    command += ["--progress", "plain"]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        command, stdout=quiet, stderr=subprocess.PIPE, text=True, env=_ENVIRONMENT
    )


def finish(show: Path) -> None:
    """Run the sequence to its end, which must be a good one."""
    run = start(show, 1)
    begun(run)
    assert run.wait(600) == 0


def kill(show: Path, victim: str, after: float, chance: random.Random) -> tuple[bool, int, float]:
    """Kill a run or one of its workers some seconds after it began its first shot.

    Return whether it was hit while it worked, how the run ended, and how long it worked [s].
    """
    run = start(show)
    begun(run)
    begin = time.perf_counter()
    with suppress(subprocess.TimeoutExpired):
        run.wait(after)
    worked = time.perf_counter() - begin
    team = workers_of(run.pid)
    targets = [run.pid] if victim == "parent" else team
    hit = False
    if run.poll() is None and targets:
        with suppress(ProcessLookupError):
            os.kill(chance.choice(targets), signal.SIGKILL)
            hit = True
    status = run.wait(600)
    orphans_end(team)
    return hit, status, worked


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a run."""
    found = []
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                if works(int(child)):
                    found.append(int(child))
    return found


def orphans_end(team: list[int]) -> None:
    """Wait until the workers of a killed run have ended: they finish their shot first."""
    end = time.monotonic() + 60
    while any(works(pid) for pid in team) and time.monotonic() < end:
        time.sleep(0.05)


def works(pid: int) -> bool:
    """Return whether a process is a worker."""
    with suppress(OSError):
        return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    return False


def results(shots: list[Path]) -> list[dict[str, str]]:
    """Return the digests of each shot's layers."""
    return [
        {
            path.name: hashlib.sha256(path.read_bytes()).hexdigest()
            for path in (root_of(shot), *sorted(folder_of(shot).glob("*.usdc")))
        }
        for shot in shots
    ]


def root_of(shot: Path) -> Path:
    """Return the root layer of a shot's result."""
    return shot.with_name(f"{shot.stem}.usdface.usda")


def folder_of(shot: Path) -> Path:
    """Return the folder of a shot's result."""
    return shot.with_name(f"{shot.stem}.usdface")


def state(shot: Path, old: dict[str, str], new: dict[str, str]) -> str:
    """Return whether a result is the old or the new one, opened as any program does."""
    stage = Usd.Stage.Open(str(root_of(shot)))
    if stage.GetCompositionErrors():
        return "DOES NOT COMPOSE"
    used = {}
    for layer in stage.GetUsedLayers():
        path = Path(layer.realPath)
        if layer.realPath and path.suffix == ".usdc" and "usdface" in str(path.parent.name):
            used[layer.GetDisplayName()] = hashlib.sha256(path.read_bytes()).hexdigest()
    layers = [sorted(d for n, d in files.items() if n.endswith(".usdc")) for files in (old, new)]
    del stage
    mine = sorted(used.values())
    record = folder_of(shot) / "record.json"
    with suppress(ValueError):
        json.loads(record.read_text()) if record.is_file() else None
    if mine in layers:
        return ("whole, the earlier one", "whole, the new one")[layers.index(mine)]
    return "MIXED"
