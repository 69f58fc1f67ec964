"""SIGKILL of a sequence's workers and parent at random moments, and a look at what is left."""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from pxr import Usd

from benchmarks.sequence.show import make_show

__all__ = ["run_kills"]

_SHOTS, _FRAMES = 4, 60
_LATEST = 0.8  # shares of an undisturbed run


def run_kills(folder: Path, kills: int, seed: int, seconds: float) -> None:
    """Kill runs, alternately the parent and a worker, for some seconds; print what was found.

    After each kill every result that is there must open as a whole, and be the old or the new one;
    the next run must complete, with the bytes of a run that nobody disturbed. Every third run
    begins from a changed gain, so that there is an earlier result to lose.
    """
    show = make_show(folder / "show", _SHOTS, _FRAMES)
    chance = random.Random(seed)
    shots = sorted((show.parent / "shots").glob("*.usda"))
    begin = time.perf_counter()
    finish(show)
    whole = time.perf_counter() - begin
    generations = [results(shots)]
    set_gain(shots, 1)
    finish(show)
    generations.append(results(shots))
    found: Counter[str] = Counter()
    end = time.monotonic() + seconds
    done = 0
    for number in range(kills):
        if time.monotonic() > end:
            break
        done += 1
        generation = (number // 2) % 2
        set_gain(shots, generation)
        if number % 3 == 0:  # nothing is cached: the solve itself is killed
            for file in (show.parent / "shots").glob("*.usdface/cache/*"):
                file.unlink()
        victim = "parent" if number % 2 else "worker"
        found[f"{victim} killed, {kill(show, victim, chance.uniform(0.1, _LATEST) * whole)}"] += 1
        for shot, old, new in zip(shots, *generations, strict=True):
            found[f"result {state(shot, old, new)}"] += 1
        finish(show)
        same = results(shots) == generations[generation]
        found["next run complete" if same else "NEXT RUN WRONG"] += 1
        litter = [p for p in show.parent.rglob(".usdface-*")]
        found["LITTER"] += bool(litter)
    print(f"{done:6} kills")
    for what, count in sorted(found.items()):
        print(f"{count:6} {what}")


def set_gain(shots: list[Path], generation: int) -> None:
    """Write the gain of a generation into the shots."""
    values = ("float usdface:gain = 1\n", "float usdface:gain = 0.5\n")
    for shot in shots:
        text = shot.read_text()
        wanted = text.replace(values[1 - generation], values[generation], 1)
        if values[generation] not in text.replace(values[1 - generation], "", 1) or wanted != text:
            shot.write_text(wanted)


def start(show: Path) -> subprocess.Popen[bytes]:
    """Start a sequence with two workers."""
    command = [sys.executable, "-m", "usdface", "sequence", str(show), "--workers", "2"]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, stdout=quiet, stderr=quiet)


def finish(show: Path) -> None:
    """Run the sequence to its end, which must be a good one."""
    assert start(show).wait(600) == 0


def kill(show: Path, victim: str, after: float) -> str:
    """Kill a run or one of its workers after some seconds; return how the run ended."""
    run = start(show)
    time.sleep(after)
    targets = [run.pid] if victim == "parent" else workers_of(run.pid)
    hit = False
    for target in targets[:1] if run.poll() is None else ():
        with suppress(ProcessLookupError):
            os.kill(target, signal.SIGKILL)
            hit = True
    status = run.wait(600)
    orphans_end(show)
    return f"exit {status}" if hit else f"too late, exit {status}"


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a run."""
    found = []
    with suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                with suppress(OSError):
                    if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                        found.append(int(child))
    random.shuffle(found)
    return found


def orphans_end(show: Path) -> None:
    """Wait until workers without a parent have ended: they finish their shot first."""
    del show
    end = time.monotonic() + 60
    while time.monotonic() < end:
        left = subprocess.run(["pgrep", "-P", "1", "-f", "spawn_main"], capture_output=True)
        if not left.stdout.strip():
            return
        time.sleep(0.05)


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
        return "whole"
    return "MIXED"
