"""Give spoilt files to every reader and command: `python tests/attack/inputs.py --inputs 100000`.

Each spoilt file goes to a reader of the library, one in 20 to a command (`usdface.cli`), one in
2,000 to the program, in a process of its own. Readers and commands run in forks of a process that
has loaded everything, with limits of memory (ten times the file and 300 MB) and of time. USD files
are opened by a worker first, as users have it. Verdicts:

accepted    read, without a finding; every number is finite and nothing is of another folder
finding     likewise, with findings
refused     one line of printable characters, at most 1000; nothing is written
isolated    refused likewise, by or for the worker that opens USD files first
traceback, crash, hang, memory, characters, lines, half, escape, infinite      faults

`--state FILE` keeps the counts, and goes on where an earlier run ended. A fault is shown again by
`--only SEED --first NUMBER --inputs 1`.
"""

import argparse
import json
import os
import random
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]
os.environ.setdefault("PXR_WORK_THREAD_LIMIT", "1")  # threads do not survive a fork
os.environ.pop("USDFACE_TRUSTED", None)

from attack.isolated import Workers, without_memory  # noqa: E402

WORKERS = Workers()  # forks before this process has loaded anything

import numpy as np  # noqa: E402
from attack.mutators import spoilt  # noqa: E402
from attack.seeds import SECRET, Seed, make_seeds  # noqa: E402

from usdface.cli import _message_and_code  # noqa: E402
from usdface.cli import main as usdface  # noqa: E402
from usdface.findings import Finding  # noqa: E402
from usdface.io.usd import sandbox  # noqa: E402
from usdface.takes import MarkerTake  # noqa: E402

__all__ = ["Verdicts", "attack"]

SECONDS, WALL = 10.0, 120.0  # of processor time; by the clock, for what waits
MEMORY, PER_BYTE = 300 * 2**20, 10
COMMANDS, PROGRAMS = 1 / 20, 1 / 2000
PLAIN = ("accepted", "finding", "refused", "isolated")
BESIDE = (
    "small.bin",
    "skin.png",
    "rig.usda",
    "take.usda",
    "wide.csv",
    "neutral.obj",
    "jawOpen.obj",
)
_SECRETS = np.array([struct.unpack("<f", (2 * SECRET)[k : k + 4])[0] for k in range(len(SECRET))])


@dataclass
class Verdicts:
    """Counts by seed, way of reading, class of the first fault and verdict; faults by number."""

    counts: Counter[tuple[str, str, str, str]] = field(default_factory=Counter)
    faults: list[tuple[str, int, str]] = field(default_factory=list)
    rounds: int = 0
    seeds: list[str] = field(default_factory=list)  # done in this round

    def add(self, name: str, number: int, way: str, kind: str, verdict: str) -> None:
        word = verdict.split(":")[0]
        self.counts[name, way, kind, word] += 1
        if word not in PLAIN:
            print(name, number, way, verdict, flush=True)
            self.faults.append((name, number, f"{way} {verdict}"))

    @property
    def total(self) -> int:
        return sum(self.counts.values())

    @classmethod
    def load(cls, file: Path | None) -> "Verdicts":
        if file is None or not file.exists():
            return cls()
        held = json.loads(file.read_text())
        counts = Counter({tuple(key): number for *key, number in held["counts"]})
        faults = [tuple(fault) for fault in held["faults"]]
        return cls(counts, faults, held["rounds"], held.get("seeds", []))

    def save(self, file: Path | None) -> None:
        if file is None:
            return
        counts = [[*key, number] for key, number in sorted(self.counts.items())]
        half = file.with_suffix(".half")
        half.write_text(
            json.dumps(
                {
                    "rounds": self.rounds,
                    "seeds": self.seeds,
                    "counts": counts,
                    "faults": self.faults,
                },
                indent=0,
            )
        )
        half.replace(file)


def attack(seed: Seed, numbers: range, folder: Path, verdicts: Verdicts) -> None:
    """Spoil a seed in the ways of `numbers`, and count what comes of it."""
    left = list(numbers)
    while left:
        done, fault = _batch(seed, left, folder)
        for number, (way, kind, verdict) in zip(left, done, strict=False):
            verdicts.add(seed.name, number, way, kind, verdict)
        left = left[len(done) :]
        if left and fault:
            # In the fork it ended with its limits; this is how users have it.
            way, kind, verdict = _by_program(seed, left[0], folder)
            plain = verdict.split(":")[0] in PLAIN
            named = f"{fault}, alone {verdict}" if plain else f"{verdict} (in the fork {fault})"
            verdicts.add(seed.name, left[0], way, kind, named)
            left = left[1:]


def _batch(
    seed: Seed, numbers: Sequence[int], folder: Path
) -> tuple[list[tuple[str, str, str]], str]:
    """Run spoilt files in a fork; return the verdicts, and how the next one ended the fork."""
    log = folder / "verdicts"
    log.write_bytes(b"")
    _furnish(seed, folder)
    alive, kept = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(alive)
        try:
            _try_all(seed, numbers, folder, log)
        finally:
            os._exit(0)
    os.close(kept)
    fault, size, seconds, clock = "", 0, 0.0, time.monotonic()
    while not select.select([alive], [], [], 0.5)[0]:
        used = _seconds_of(child)
        if (grown := log.stat().st_size) != size:
            size, seconds, clock = grown, used, time.monotonic()
        if used - seconds > SECONDS or time.monotonic() - clock > WALL:
            fault = "hang"
            os.kill(child, signal.SIGKILL)
            break
    os.close(alive)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    lines = [line for line in log.read_bytes().split(b"\n")[:-1]]
    done = [tuple(json.loads(line)) for line in lines]
    return done, fault or (f"crash: {status}" if len(done) < len(numbers) else "")


def _furnish(seed: Seed, folder: Path) -> None:
    for name in ("in", "out"):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir()
    for name in BESIDE:
        shutil.copy(seed.file.parent / name, folder / "in" / name)


def _seconds_of(child: int) -> float:
    with suppress(OSError):
        parts = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
        return (int(parts[11]) + int(parts[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _try_all(seed: Seed, numbers: Sequence[int], folder: Path, log: Path) -> None:
    from usdface.__main__ import _quiet_libraries

    output = os.open(folder / "said", os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
    os.dup2(output, 2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.argv[1:] = []
    _quiet_libraries()
    warnings.simplefilter("ignore")
    sandbox.subprocess = WORKERS  # type: ignore[attr-defined]
    os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    base = pages * os.sysconf("SC_PAGESIZE")
    with log.open("ab", buffering=0) as named:
        for number in numbers:
            os.ftruncate(output, 0)
            found = _tried(seed, number, folder, base)
            named.write(json.dumps(found).encode() + b"\n")


def _tried(seed: Seed, number: int, folder: Path, base: int) -> tuple[str, str, str]:
    data, kind, rng = _spoilt(seed, number)
    without_memory(folder / "cache")
    file = folder / "in" / seed.file.name
    file.unlink(missing_ok=True)
    file.write_bytes(data)
    drawn = rng.random()
    limits = base + MEMORY + PER_BYTE * len(data)
    if drawn < PROGRAMS and seed.commands:
        return _program(seed, rng, kind, folder)
    resource.setrlimit(resource.RLIMIT_DATA, (limits, resource.RLIM_INFINITY))
    if drawn < COMMANDS and seed.commands:
        return "command", kind, _command(seed, rng, folder)
    return "reader", kind, _read(rng.choice(seed.readers), file)


def _spoilt(seed: Seed, number: int) -> tuple[bytes, str, random.Random]:
    rng = random.Random(f"{seed.name} {number}")
    return *spoilt(seed.data, rng, seed.kind), rng


def _read(reader: Any, file: Path) -> str:
    """Read a file by the library, and judge what came of it."""
    try:
        found = reader(file)
    except MemoryError:
        return "memory"
    except Exception as error:
        return _refusal(f"usdface: {_message_and_code(error)[0]}\n")
    findings: list[Finding] = []
    for value in _values(found, findings):
        if isinstance(value, bytes):
            if SECRET in value:
                return "escape"
        elif np.isinf(value).any():
            return "infinite"
        elif np.isin(value, _SECRETS).any():
            return "escape"
    for finding in findings:
        text = f"{finding.message}{finding.where}"
        if not text.isprintable() or len(text) > 1300:
            return f"characters: {text[:300]!r}"
    return "finding" if findings else "accepted"


def _values(found: Any, findings: list[Finding]) -> Iterator[Any]:
    """Yield the arrays of floats and the bytes of a result, and list its findings."""
    if isinstance(found, Finding):
        findings.append(found)
    elif isinstance(found, np.ndarray):
        if found.dtype.kind == "f":
            yield found
            if np.isnan(found).any():
                yield np.array([np.inf])
    elif isinstance(found, MarkerTake):  # NaN is occluded
        yield found.times
        yield np.nan_to_num(found.positions, nan=0.0, posinf=np.inf, neginf=-np.inf)
    elif isinstance(found, bytes):
        yield found
    elif is_dataclass(found):
        for part in fields(found):
            yield from _values(getattr(found, part.name), findings)
    elif isinstance(found, dict):
        yield from _values(list(found.values()), findings)
    elif isinstance(found, list | tuple):
        for part in found:
            yield from _values(part, findings)


def _refusal(text: str) -> str:
    last = text.splitlines()[-1][:300] if text.strip() else ""
    if "MemoryError" in text or "bad_alloc" in text or "not enough memory" in text:
        return f"memory: {last}"
    if "a mistake in usdface" in text or "Traceback" in text:
        return f"traceback: {last}"
    if [c for c in text if not c.isprintable() and c != "\n"]:
        return f"characters: {text[:300]!r}"
    if text.count("\n") > 1 or len(text) > 1000:
        return f"lines: {text[:300]!r}"
    worker = ("ends the process that opens it", "takes more than", "takes too much time to open")
    return "isolated" if any(word in text for word in worker) else "refused"


def _arguments(seed: Seed, rng: random.Random, folder: Path) -> list[str]:
    words = {"FILE": str(folder / "in" / seed.file.name), "FOLDER": str(folder / "in")}
    shutil.rmtree(folder / "out")
    (folder / "out").mkdir()
    command = rng.choice(seed.commands)
    return [words.get(word, word.replace("OUT", str(folder / "out"))) for word in command]


def _command(seed: Seed, rng: random.Random, folder: Path) -> str:
    arguments = _arguments(seed, rng, folder)
    try:
        status = usdface(arguments)
    except MemoryError:
        return "memory"
    except BaseException as error:
        return f"traceback: {type(error).__name__}: {error}"
    sys.stderr.flush()
    return _of_run(status, (folder / "said").read_bytes(), folder)


def _of_run(status: int, message: bytes, folder: Path) -> str:
    """Judge a command by how it ended, its words and what it left."""
    text = message.decode("utf-8", "replace")
    if status not in (0, 1):
        return f"crash: {status} {text[-200:]!r}"
    left = [path for path in (folder / "out").rglob("*") if path.is_file()]
    if any(".usdface-" in str(path) for path in left) or (status != 0 and left):
        return f"half: {left}"
    if any(SECRET in path.read_bytes() for path in left):
        return "escape"
    if status != 0 or text.strip():
        found = _refusal(text)
        if status != 0 or found not in ("refused", "isolated"):
            return found  # `check` that finds errors fails without a line on standard error
    if not all(map(_opens, left)):
        return f"half: {left}"
    return "accepted"


def _opens(file: Path) -> bool:
    if file.suffix == ".usda":
        return file.read_bytes().startswith(b"#usda 1.0") and file.read_bytes().endswith(b"\n")
    if file.suffix == ".glb":
        return struct.unpack("<4sII", file.read_bytes()[:12])[2] == file.stat().st_size
    return True


def _by_program(seed: Seed, number: int, folder: Path) -> tuple[str, str, str]:
    data, kind, rng = _spoilt(seed, number)
    _furnish(seed, folder)
    (folder / "in" / seed.file.name).write_bytes(data)
    if not seed.commands:
        return "program", kind, "no command reads it"
    rng.random()
    return _program(seed, rng, kind, folder)


def _program(seed: Seed, rng: random.Random, kind: str, folder: Path) -> tuple[str, str, str]:
    arguments = _arguments(seed, rng, folder)
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    environment.pop("PXR_WORK_THREAD_LIMIT", None)
    command = [sys.executable, "-m", "usdface", *arguments]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(command, capture_output=True, env=environment, timeout=600)
    except subprocess.TimeoutExpired:
        return "program", kind, "hang"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if used > SECONDS + 3:  # and the start of two processes
        return "program", kind, f"hang: {used:.0f} s"
    return "program", kind, _of_run(done.returncode, done.stderr, folder)


def check_seeds(seeds: Sequence[Seed], folder: Path) -> None:
    """Fail unless every good file is accepted by everything that reads it."""
    for seed in seeds:
        for target in (*seed.readers, *seed.commands):
            _furnish(seed, folder)
            shutil.copy(seed.file, folder / "in" / seed.file.name)
            if callable(target):
                found = _read(target, folder / "in" / seed.file.name)
            else:
                rng = random.Random(0)
                one = Seed(seed.name, seed.file, seed.kind, (), (target,))
                found = _program(one, rng, "", folder)[2]
            if found not in ("accepted", "finding"):
                raise RuntimeError(f"{seed.name} is not accepted by {target}: {found}")


def print_table(verdicts: Verdicts) -> None:
    """Print the counts as tables of Markdown."""
    words = sorted({key[3] for key in verdicts.counts}, key=lambda w: (w not in PLAIN, w))
    for title, column in (("file", 0), ("read by", 1), ("first fault in", 2)):
        print(f"\n| {title} | {' | '.join(words)} |\n|---|{'---|' * len(words)}")
        rows = dict.fromkeys(key[column] for key in verdicts.counts)
        for row in sorted(rows):
            numbers = [
                sum(n for key, n in verdicts.counts.items() if (key[column], key[3]) == (row, word))
                for word in words
            ]
            print(f"| {row} | {' | '.join(f'{number:,}' for number in numbers)} |")
    print(f"\n{verdicts.total:,} inputs, {len(verdicts.faults)} faults")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--only", default="", help="the seed of this name")
    parser.add_argument("--first", type=int, help="with --only: the number of the first")
    parser.add_argument("--share", type=float, default=1.0, help="of a round, so that it is short")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after")
    parser.add_argument("--state", type=Path, help="keep the counts in this file, and go on")
    given = parser.parse_args()
    roomy = Path("/dev/shm")
    place = Path(tempfile.mkdtemp(prefix="usdface-attack-", dir=roomy if roomy.is_dir() else None))
    verdicts = Verdicts.load(given.state)
    begin = time.monotonic()
    try:
        (place / "work" / "seeds").mkdir(parents=True)
        os.environ["XDG_CACHE_HOME"] = str(place / "cache")
        folder = place / "work"
        seeds = make_seeds(folder / "seeds")
        if given.first is not None:
            seed = next(seed for seed in seeds if seed.name == given.only)
            attack(seed, range(given.first, given.first + given.inputs), folder, verdicts)
            seeds = []
        check_seeds(seeds, folder)
        end = begin + given.seconds
        while seeds and verdicts.total < given.inputs and time.monotonic() < end:
            for seed in (seed for seed in seeds if seed.name not in verdicts.seeds):
                count = max(1, int(given.share * seed.share)) if time.monotonic() < end else 0
                first = verdicts.rounds * seed.share
                attack(seed, range(first, first + count), folder, verdicts)
                verdicts.seeds.append(seed.name)
                verdicts.save(given.state)
            verdicts.rounds, verdicts.seeds = verdicts.rounds + 1, []
    finally:
        shutil.rmtree(place, ignore_errors=True)
    print_table(verdicts)
    return 1 if verdicts.faults else 0


if __name__ == "__main__":
    sys.exit(main())
