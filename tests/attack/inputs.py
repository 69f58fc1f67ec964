"""Give spoilt files to every reader and command: `python tests/attack/inputs.py --inputs 100000`.

Batches run in forks of a process that has loaded everything, with limits of memory (ten times the
file and 300 MB) and time. USD files are opened at once there; where that ends the process, or takes
too long or too much, the command runs again as users have it, with its worker. Verdicts:

accepted      exit status 0, within the limits
refused       exit status 1 and one line, of printable characters, at most 1000
worker        refused likewise, where opening the file at once would have ended the process
traceback, crash, hang, memory, characters, lines, litter      faults
"""

import argparse
import io
import json
import os
import random
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, field
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]
os.environ.setdefault("PXR_WORK_THREAD_LIMIT", "1")  # threads do not survive a fork
os.environ["USDFACE_TRUSTED"] = "1"

from attack.mutators import spoilt  # noqa: E402
from worlds import make_world  # noqa: E402

from usdface.cli import main as usdface  # noqa: E402

__all__ = ["Seed", "Verdicts", "attack", "make_seeds"]

SECONDS, MEMORY, PER_BYTE = 10.0, 300 * 2**20, 10
BATCH = 40
PLAIN = ("accepted", "refused", "worker")


@dataclass(frozen=True)
class Seed:
    """A good file, and the commands that read it: `FILE` is the spoilt one, `OUT` a folder."""

    name: str
    file: Path
    commands: tuple[tuple[str, ...], ...]
    binary: bool

    @property
    def usd(self) -> bool:
        return ".usd" in self.name


@dataclass
class Verdicts:
    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    faults: list[tuple[str, int, str]] = field(default_factory=list)

    def add(self, name: str, number: int, verdict: str) -> None:
        self.counts[name, verdict.split(":")[0]] += 1
        if verdict.split(":")[0] not in PLAIN:
            print(name, number, verdict, flush=True)
            self.faults.append((name, number, verdict))


def make_seeds(place: Path) -> list[Seed]:
    """Write a good file of every format."""
    from every_term import SYSTEMS
    from pxr import Sdf

    from usdface.io.fuzzy_formats.files import write_fuzzy_file

    world = make_world()
    world.write(place)
    for name in ("rig", "take"):
        Sdf.Layer.FindOrOpen(str(place / f"{name}.usda")).Export(str(place / f"{name}.usdc"))
    shot = ["--rig", "rig.usda", "--take", "take.usda", "--bind", "bind.json", "-o", "shot.usda"]
    run(["shot", *(str(place / w) if "." in w else w for w in shot)])
    for name in ("face.glb", "face.gltf", "face.usdz"):
        run(["export", str(place / "rig.usda"), "-o", str(place / name)])
    for name in ("mamdani", "default"):
        for suffix in (".fis", ".fcl", ".fll", ".usda"):
            write_fuzzy_file(place / f"{name}{suffix}", SYSTEMS[name])
    _write_takes(place)
    (place / "meshes").mkdir()
    (place / "meshes/neutral.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (place / "meshes/jawOpen.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    (place / "expressions.json").write_text(
        '{"contempt": {"units": {"12L": 0.3, "14L": 0.9}}, "joy": {"shapes": {"jawOpen": 0.4}}}'
    )
    (place / "calibration.json").write_text(
        '{"shapes": {"jawOpen": {"gain": 1.2, "deviation": 0.1, "peak": 0.9, "offset": 0.01}}}'
    )
    return list(_seeds(place))


def _write_takes(place: Path) -> None:
    import ezc3d
    import numpy as np

    rng = np.random.default_rng(0)
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [60.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["a", "b", "c"]
    file["data"]["points"] = np.concatenate([rng.normal(size=(3, 3, 20)), np.ones((1, 3, 20))])
    file.write(str(place / "take.c3d"))
    rows = ["time,a_x,a_y,a_z,b_x,b_y,b_z"]
    rows += [f"{n / 60},1,2,{n % 5},4,5,{n % 7}" for n in range(20)]
    (place / "take.csv").write_text("\n".join(rows) + "\n")
    rows = ["frame,marker,x,y,z"]
    rows += [f"{n},{m},{n % 3},2,{n % 5}" for n in range(20) for m in "ab"]
    (place / "long.csv").write_text("\n".join(rows) + "\n")
    rows = [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        "60\t60\t20\t2\tmm\t60\t1\t20",
        "Frame#\tTime\ta\t\t\tb\t\t",
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2",
        "",
        *(f"{n + 1}\t{n / 60:.5f}\t1\t2\t{n % 5}\t4\t5\t{n % 7}" for n in range(20)),
    ]
    (place / "take.trc").write_text("\n".join(rows) + "\n")
    (place / "take.bvh").write_text(
        "HIERARCHY\nROOT hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition "
        "Zrotation Xrotation Yrotation\n JOINT head\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation "
        "Xrotation Yrotation\n  End Site\n  {\n   OFFSET 0 1 0\n  }\n }\n}\nMOTION\nFrames: 5\n"
        "Frame Time: 0.0333333\n" + "0 1 2 3 4 5 6 7 8\n" * 5
    )
    rows = ["Timecode,BlendShapeCount,JawOpen,EyeBlinkLeft,BrowInnerUp,HeadYaw"]
    rows += [f"10:00:00:{2 * n:02}.5,4,0.{n},0.2,0.{n % 7},0" for n in range(20)]
    (place / "livelink.csv").write_text("\n".join(rows) + "\n")


def _seeds(place: Path) -> Iterator[Seed]:
    out = ("-o", "OUT/x.usda")
    for name in ("take.c3d", "take.csv", "long.csv", "take.trc", "take.bvh", "livelink.csv"):
        yield Seed(name, place / name, (("take", "FILE", *out),), name.endswith("c3d"))
    for name in ("take.usda", "take.usdc"):
        yield Seed(name, place / name, (("take", "FILE", *out),), name.endswith("c"))
    glb = ("-o", "OUT/x.glb")
    for name in ("rig.usda", "rig.usdc", "face.usdz"):
        commands = (("rig", "FILE", *out), ("export", "FILE", *glb), ("check", "FILE"))
        yield Seed(name, place / name, commands, not name.endswith("a"))
    for name in ("face.glb", "face.gltf"):
        commands = (("rig", "FILE", *out), ("import", "FILE", *out), ("check", "FILE"))
        yield Seed(name, place / name, commands, name.endswith("glb"))
    yield Seed("meshes", place / "meshes/jawOpen.obj", (("rig", "FOLDER", *out),), False)
    shot = tuple(f"--{n}={place / n}.usda" for n in ("rig", "take"))
    shot = ("shot", *shot, *out)
    bound = (*shot, f"--bind={place / 'bind.json'}")
    yield Seed("bind.json", place / "bind.json", ((*shot, "--bind", "FILE"),), False)
    for option in ("expressions", "calibration"):
        file = place / f"{option}.json"
        yield Seed(file.name, file, ((*bound, f"--{option}", "FILE"),), False)
    yield Seed("shot.usda", place / "shot.usda", (("process", "FILE", *out),), False)
    for name in ("mamdani", "default"):
        for suffix in (".fis", ".fcl", ".fll", ".usda"):
            file = place / f"{name}{suffix}"
            convert = ("fuzzy", "convert", "FILE", "-o", "OUT/x.fll")
            commands = (convert, convert, (*bound, "--fuzzy", "FILE"))
            yield Seed(file.name, file, commands, False)


def run(arguments: list[str]) -> None:
    with suppress(SystemExit), redirect_stdout(io.StringIO()):
        if usdface(arguments) == 0:
            return
    raise RuntimeError(f"the seed cannot be made: {arguments}")


def attack(seed: Seed, numbers: range, folder: Path, verdicts: Verdicts) -> None:
    """Spoil a seed in the ways of `numbers`, and count what comes of it."""
    waiting = list(numbers)
    while waiting:
        batch, waiting = waiting[:BATCH], waiting[BATCH:]
        while batch:
            done, fault = _batch(seed, batch, folder)
            for number, found in done:
                if seed.usd and found.split(":")[0] in ("memory", "lines"):
                    found = _again(seed, number, folder, found)
                verdicts.add(seed.name, number, found)
            batch = batch[len(done) :]
            if fault and batch:
                verdicts.add(seed.name, batch[0], _again(seed, batch[0], folder, fault))
                batch = batch[1:]


def _batch(seed: Seed, batch: list[int], folder: Path) -> tuple[list[tuple[int, str]], str]:
    """Run spoilt files in a fork; return the verdicts, and how the next one ended the fork."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        try:
            _try_all(seed, batch, folder, lambda line: os.write(write, line.encode()))
        finally:
            os._exit(0)
    os.close(write)
    text, fault = b"", ""
    while True:
        if not select.select([read], [], [], SECONDS)[0]:
            fault = "hang"
            os.kill(child, signal.SIGKILL)
            break
        part = os.read(read, 65536)
        if not part:
            break
        text += part
    os.close(read)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    verdicts = [json.loads(line) for line in text.splitlines()]
    done = list(zip(batch, verdicts, strict=False))
    return done, fault or (f"crash: {status}" if len(done) < len(batch) else "")


def _try_all(seed: Seed, batch: list[int], folder: Path, tell: Callable[[str], object]) -> None:
    output = os.open(folder / "said", os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    base = pages * os.sysconf("SC_PAGESIZE")
    warnings.simplefilter("ignore")  # as the program does
    for number in batch:
        arguments, size = prepared(seed, number, folder)
        os.ftruncate(output, 0)
        os.lseek(output, 0, os.SEEK_SET)
        most = base + MEMORY + PER_BYTE * size
        resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))
        try:
            status: object = usdface(arguments)
        except MemoryError:
            status = "memory"
        except BaseException as error:
            status = f"traceback: {type(error).__name__}: {error}"
        sys.stderr.flush()
        said = (folder / "said").read_bytes()
        tell(json.dumps(verdict(status, said, folder / "out")) + "\n")


def prepared(seed: Seed, number: int, folder: Path) -> tuple[list[str], int]:
    """Write the spoilt file and an empty folder; return the command and the file's size."""
    rng = random.Random(f"{seed.name} {number}")
    data = spoilt(seed.file.read_bytes(), rng, seed.binary)
    shutil.rmtree(folder / "in", ignore_errors=True)
    shutil.rmtree(folder / "out", ignore_errors=True)
    (folder / "out").mkdir()
    if seed.name == "meshes":
        shutil.copytree(seed.file.parent, folder / "in")
    else:
        (folder / "in").mkdir()
        for name in ("rig.usda", "take.usda", "face.bin"):  # that shots and .gltf files name
            (folder / "in" / name).symlink_to(seed.file.parent / name)
    file = folder / "in" / seed.file.name
    file.unlink(missing_ok=True)
    file.write_bytes(data)
    words = {"FILE": str(file), "FOLDER": str(folder / "in")}
    command = rng.choice(seed.commands)
    return [words.get(w, w.replace("OUT", str(folder / "out"))) for w in command], len(data)


def verdict(status: object, said: bytes, out: Path) -> str:
    """Judge how a command ended, what it said and what it left."""
    text = said.decode("utf-8", "replace")
    last = text.splitlines()[-1][:300] if text.strip() else ""
    if isinstance(status, str):
        return status
    if "MemoryError" in text or "bad_alloc" in text:
        return f"memory: {last}"
    if "a mistake in usdface" in text or "Traceback" in text:
        return f"traceback: {last}"
    if [c for c in text if not c.isprintable() and c != "\n"]:
        return f"characters: {text[:300]!r}"
    if status != 0 and (text.count("\n") > 1 or len(text) > 1000):  # `check` fails without a word
        return f"lines: {text[:300]!r}"
    left = [p for p in out.rglob("*") if p.is_file()]
    if any(".usdface-" in str(p) for p in left) or (status != 0 and left):
        return f"litter: {left}"
    return "accepted" if status == 0 else "refused"


def _again(seed: Seed, number: int, folder: Path, fault: str) -> str:
    """Run a command that ended the fork again, as users have it; its verdict."""
    arguments, _ = prepared(seed, number, folder)
    ours = ("USDFACE_TRUSTED", "PXR_WORK_THREAD_LIMIT")
    environment = {k: v for k, v in os.environ.items() if k not in ours}
    environment["XDG_CACHE_HOME"] = str(folder / "cache")
    command = [sys.executable, "-m", "usdface", *arguments]
    begin = _seconds_of_children()
    try:
        done = subprocess.run(command, capture_output=True, env=environment, timeout=600)
    except subprocess.TimeoutExpired:
        return f"hang: {fault}, and with a worker"
    said = done.stderr.replace(b"#", b"")
    found = verdict(done.returncode, done.stderr, folder / "out")
    if done.returncode not in (0, 1):
        return f"crash: {done.returncode} {said[-200:]!r}"
    if found == "refused":
        return "worker" if _seconds_of_children() - begin < SECONDS else "hang: of the worker"
    return found if found != "accepted" else f"accepted: after {fault}"


def _seconds_of_children() -> float:
    """Return processor time: other programs lengthen the wall clock, not this."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first spoilt file")
    parser.add_argument("--only", default="", help="seeds whose name holds this")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after")
    given = parser.parse_args()
    place, verdicts = Path(tempfile.mkdtemp(prefix="usdface-attack-")), Verdicts()
    begin = time.monotonic()
    try:
        (place / "seeds").mkdir()
        seeds = [s for s in make_seeds(place / "seeds") if given.only in s.name]
        count = max(1, given.inputs // len(seeds))
        for first in range(given.first, given.first + count, BATCH):
            for seed in seeds:
                numbers = range(first, min(first + BATCH, given.first + count))
                if time.monotonic() - begin < given.seconds:
                    attack(seed, numbers, place, verdicts)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    for (name, kind), number in sorted(verdicts.counts.items()):
        print(f"{number:8} {name}: {kind}")
    print(f"{sum(verdicts.counts.values())} inputs, {len(verdicts.faults)} faults")
    return 1 if verdicts.faults else 0


if __name__ == "__main__":
    sys.exit(main())
