"""Kill commands at random moments and look at what is left: `python tests/attack/kills.py`.

Every command runs in a fork of a process that has loaded everything, over the result of an earlier
run that differs. Half of the kills come anywhere in the run, half while files are written. Then
a reader opens the result as other programs do, a reader of usdface opens it, and the command runs
again. Verdicts:

old, new    all of the result is that of the earlier run, or of the killed one
apart       layers and glTF are of two runs, until usdface reads or writes there
lost        a file of the result is missing or cannot be opened
mixed       the result is neither the one nor the other
litter      a file that belongs to none is there after the next run, or after SIGINT or SIGTERM
silent      SIGINT or SIGTERM, but no line, or another exit status
"""

import argparse
import atexit
import hashlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("PXR_WORK_THREAD_LIMIT", "1")  # threads do not survive a fork

from worlds import make_world

from usdface import __main__ as program
from usdface.cli import main as usdface

__all__ = ["Command", "Report", "kill", "make_commands", "run_pairs"]

SIGNALS = (8 * [signal.SIGKILL]) + [signal.SIGINT, signal.SIGTERM]
Tree = dict[str, str]


@dataclass(frozen=True)
class Command:
    """A command with two inputs; its results by the first and by the second.

    `seen` is what other programs see of a folder, for each result; `files` all files.
    """

    name: str
    folder: Path
    runs: tuple[list[str], list[str]]
    roots: tuple[str, ...]
    files: tuple[Tree, Tree] = ({}, {})
    seen: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    seconds: float = 0.0


@dataclass
class Report:
    verdicts: Counter[tuple[str, str]] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    done: int = 0

    def count(self, name: str, verdict: str, fault: bool = False) -> None:
        self.verdicts[name, verdict] += 1
        if fault:
            print(f"{name}: {verdict}", flush=True)
            self.faults.append(f"{name}: {verdict}")

    @classmethod
    def load(cls, file: Path | None) -> "Report":
        if file is None or not file.exists():
            return cls()
        held = json.loads(file.read_text())
        verdicts = Counter({(name, verdict): number for name, verdict, number in held["verdicts"]})
        return cls(verdicts, held["faults"], held["done"])

    def save(self, file: Path | None) -> None:
        if file is None:
            return
        verdicts = [[*key, number] for key, number in sorted(self.verdicts.items())]
        half = file.with_suffix(".half")
        held = {"done": self.done, "verdicts": verdicts, "faults": self.faults}
        half.write_text(json.dumps(held))
        half.replace(file)


def run(words: list[str]) -> int:
    """Run a command, or as a host does that holds a stage open, `usdface.apply`."""
    if words[0] != "apply":
        return usdface(words)
    from pxr import Usd

    import usdface as library
    from usdface.io.atomic import write_text
    from usdface.options import ProcessOptions
    from usdface.signals import say_stopped

    shot, factor, output = words[1:]
    stage = Usd.Stage.CreateInMemory()
    layer = stage.GetRootLayer()
    if Path(output).exists():
        layer.ImportFromString(Path(output).read_text())
    layer.subLayerPaths = [shot]
    status = 0
    try:
        library.apply(stage, options=ProcessOptions(exaggeration={"face": float(factor)}))
    except KeyboardInterrupt:
        status = say_stopped()
    write_text(Path(output), layer.ExportToString())  # whatever came of it
    return status


def in_fork(job: Callable[[], object], log: Path | None = None) -> int:
    """Start a job in a fork with its output in a file; return the process id."""
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    status = 99
    try:
        output = os.open(log or os.devnull, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        found = job()
        status = found if isinstance(found, int) else 0
    except BaseException as error:
        print(repr(error), file=sys.stderr)
    finally:
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def waited(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def tree(folder: Path) -> Tree:
    """Every file below, by its content."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def seen(root: Path) -> str:
    """What a program sees that opens `root` and all that it names."""
    if root.suffix in (".usda", ".usdc"):
        from pxr import Usd, UsdUtils

        stage = Usd.Stage.Open(str(root))
        _, assets, missing = UsdUtils.ComputeAllDependencies(str(root))
        if missing or stage.GetCompositionErrors():
            raise FileNotFoundError(f"{missing}")
        places = sorted(Path(p).read_bytes() for p in assets)
        text = stage.Flatten(addSourceFileComment=False).ExportToString()
        # A texture is named by its bytes: its path is another while files get their places.
        text = "\n".join(line for line in text.splitlines() if "asset inputs:file" not in line)
        return hashlib.sha256(b"\0".join([text.encode(), *places])).hexdigest()
    data = [root.read_bytes()]
    if root.suffix == ".gltf":
        document = json.loads(data[0])
        for named in (*document.get("buffers", ()), *document.get("images", ())):
            data.append((root.parent / unquote(named.pop("uri"))).read_bytes())
        data[0] = json.dumps(document).encode()
    return hashlib.sha256(b"\0".join(data)).hexdigest()


def all_seen(command: Command) -> tuple[str, ...]:
    """What a new process sees of each root; "" for one that cannot be opened."""
    read, write = os.pipe()

    def look() -> None:
        for root in command.roots:
            try:
                found = seen(command.folder / root)
            except Exception:
                found = ""
            os.write(write, f"{found}\n".encode())

    child = in_fork(look)
    os.close(write)
    with os.fdopen(read) as pipe:
        lines = pipe.read().splitlines()
    waited(child)
    return tuple(lines)


def make_commands(place: Path) -> list[Command]:
    """Make inputs in a folder, and the two results of every command."""
    from usdface.io.usd.rig_write import write_rig
    from usdface.materials import Material, Texture

    world = make_world()
    inputs: list[Path] = []
    for k in (0, 1):
        folder = world.write(place / f"in{k}")
        png = b"\x89PNG\r\n\x1a\n" + bytes([k]) * 3000
        skin = Material("Skin", base_color_texture=Texture(data=png, suffix=".png"))
        (mesh,) = world.rig.meshes
        mesh = replace(mesh, material="Skin", points=(1 + k) * mesh.points)
        write_rig(replace(world.rig, meshes=(mesh,), materials=(skin,)), folder / "scene.usda")
        rows = [",".join(["time", "a_x", "a_y", "a_z", "b_x", "b_y", "b_z"])]
        rows += [f"{n / 60},1,2,{n % (5 + k)},4,5,{n % 7}" for n in range(200 + 100 * k)]
        (folder / "take.csv").write_text("\n".join(rows))
        for words in (
            ["export", folder / "scene.usda", "-o", folder / "face.glb"],
            ["shot", "--rig", folder / "rig.usda", "--take", folder / "take.usda",
             "--bind", folder / "bind.json", "--gain", 1 - k / 2, "-o", folder / "shot.usda"],
        ):  # fmt: skip
            assert waited(in_fork(lambda words=words: usdface([str(w) for w in words]))) == 0
        inputs.append(folder)
    a, _ = inputs
    shot = ["shot", "--rig", a / "rig.usda", "--take", a / "take.usda", "--bind", a / "bind.json"]
    process = ["process", a / "shot.usda"]
    # A command without its outputs for each result, and its outputs
    wanted: dict[str, tuple[list[list[object]], dict[str, str]]] = {
        "process": (
            [[*process, "--exaggeration", 1], [*process, "--exaggeration", 1.5, "--no-closure"]],
            {"-o": "shot.usdface.usda", "--gltf": "face.glb"},
        ),
        "export glb": ([["export", i / "scene.usda"] for i in inputs], {"-o": "face.glb"}),
        "export gltf": ([["export", i / "scene.usda"] for i in inputs], {"-o": "face.gltf"}),
        "export usdz": ([["export", i / "scene.usda"] for i in inputs], {"-o": "face.usdz"}),
        "import": ([["import", i / "face.glb"] for i in inputs], {"-o": "face.usdc"}),
        "rig": ([["rig", i / "face.glb"] for i in inputs], {"-o": "rig.usda"}),
        "take": ([["take", i / "take.csv"] for i in inputs], {"-o": "take.usdc"}),
        "shot": (
            [[*shot, "--gain", gain] for gain in (1, 0.5)],
            {"-o": "shot.usda", "--write-bind": "b.json"},
        ),
        "apply": ([["apply", a / "shot.usda", factor] for factor in (1, 1.5)], {"": "host.usda"}),
    }
    return [_prepared(name, place / name, *parts) for name, parts in wanted.items()]


def _prepared(
    name: str, folder: Path, words: list[list[object]], outputs: dict[str, str]
) -> Command:
    named = [word for option, file in outputs.items() for word in (option, folder / file) if word]
    runs = [[str(word) for word in (*run, *named)] for run in words]
    command = Command(name, folder, (runs[0], runs[1]), tuple(outputs.values()))
    results = []
    for words in (*runs, runs[1]):  # the third as it is killed: over another result
        if len(results) < 2:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        begin = time.perf_counter()
        log = folder.parent / "log"
        assert waited(in_fork(lambda words=words: run(words), log)) == 0, log.read_text()
        seconds = time.perf_counter() - begin
        results.append((tree(folder), all_seen(command)))
    assert results[0] != results[1] == results[2] and "" not in results[1][1], name
    shutil.rmtree(folder.with_name(f"{name} kept"), ignore_errors=True)
    shutil.rmtree(folder)
    folder.mkdir()
    assert waited(in_fork(lambda: run(runs[0]))) == 0
    shutil.copytree(folder, folder.with_name(f"{name} kept"))
    return replace(
        command,
        files=(results[0][0], results[1][0]),
        seen=(results[0][1], results[1][1]),
        seconds=seconds,
    )


def restore(command: Command) -> None:
    shutil.rmtree(command.folder)
    shutil.copytree(command.folder.with_name(f"{command.name} kept"), command.folder)


def _staged(folder: Path) -> bool:
    with suppress(OSError):
        return any(entry.name.startswith(".usdface-") for entry in os.scandir(folder))
    return False


def kill(command: Command, rng: random.Random, report: Report) -> None:
    """Kill the second run over the result of the first, and look at what is left."""
    restore(command)
    number = rng.choice(SIGNALS)
    log = command.folder.parent / "log"

    def work() -> int:
        handle = program.handle_signals

        def handled() -> None:
            handle()
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)

        program.handle_signals = handled  # type: ignore[assignment]
        try:
            if command.runs[1][0] != "apply":
                return program.main()
            handled()
            return run(command.runs[1])
        finally:
            atexit._run_exitfuncs()

    sys.argv[1:] = command.runs[1]
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # until the command handles them
    child = in_fork(work, log)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    if rng.random() < 0.5:
        time.sleep(rng.uniform(0, 1.1 * command.seconds))
    else:
        end = time.perf_counter() + 3 * command.seconds
        while not _staged(command.folder) and time.perf_counter() < end:
            time.sleep(0)
        time.sleep(rng.choice([0.001, 0.01, 0.1]) * rng.random())
    with suppress(ProcessLookupError):
        os.kill(child, number)
    status = waited(child)
    name = command.name
    if number != signal.SIGKILL:
        words = log.read_text().splitlines()
        word = "interrupted" if number == signal.SIGINT else "terminated"
        named = status == 128 + number and words[-1:] == [f"usdface: {word}"]
        if status != 0 and not named:
            report.count(name, f"silent: {status} {words[-1:]}", fault=True)
        if _staged(command.folder):
            report.count(name, "litter of a signal", fault=True)
    found = all_seen(command)
    for k, root in enumerate(command.roots):
        if not found[k]:
            report.count(name, f"lost {root}", fault=True)
        elif found[k] not in (command.seen[0][k], command.seen[1][k]):
            report.count(name, f"mixed {root}", fault=True)
    if found not in command.seen and all(found):
        report.count(name, "apart")
    child = in_fork(lambda: _read_by_usdface(command))
    waited(child)
    left = tree(command.folder)
    settled = {f: d for f, d in left.items() if ".usdface-" not in f}
    if settled not in command.files:
        report.count(name, "mixed", fault=True)
    report.count(name, "old" if settled == command.files[0] else "new")
    again = waited(in_fork(lambda: run(command.runs[1]), log))
    left = tree(command.folder)
    if again != 0 or left != command.files[1]:
        report.count(
            name, f"litter {again} {sorted(set(left) - set(command.files[1]))}", fault=True
        )


def _read_by_usdface(command: Command) -> None:
    from usdface.io.staging import finish_dead_runs

    finish_dead_runs(command.folder)


def run_pairs(command: Command, report: Report) -> None:
    """Run both at the same time on one output: all of one of them is left."""
    restore(command)
    children = [in_fork(lambda words=words: run(words)) for words in command.runs]
    ends = [waited(child) for child in children]
    left = tree(command.folder)
    whole = left in command.files
    report.count(f"pairs, {command.name}", "one wins" if whole else f"mixed {ends}", not whole)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after")
    parser.add_argument("--state", type=Path, help="keep the counts in this file, and go on")
    given = parser.parse_args()
    report = Report.load(given.state)
    place = Path(tempfile.mkdtemp(prefix="usdface-kills-"))
    try:
        commands = make_commands(place)
        print({c.name: round(c.seconds, 2) for c in commands}, flush=True)
        end = time.monotonic() + given.seconds
        while (k := report.done) < given.kills + given.pairs and time.monotonic() < end:
            command = commands[k % len(commands)]
            if k < given.kills:
                kill(command, random.Random(f"{given.seed} {k}"), report)
            else:
                run_pairs(command, report)
            report.done += 1
            report.save(given.state)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    for (name, verdict), count in sorted(report.verdicts.items()):
        print(f"{count:6} {name}: {verdict}")
    print(f"{len(report.faults)} faults")
    return 1 if report.faults else 0


if __name__ == "__main__":
    sys.exit(main())
