"""Shots made and processed through the commands, and what became of them."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Usd
from worlds import World, animation_of, make_world

from usdface.cli import main

__all__ = [
    "EXACT",
    "Done",
    "codes_in",
    "digests",
    "process",
    "processed_world",
    "report",
    "run",
    "shoot",
    "solved",
    "without_animation",
]

# Weights from markers that went through float32 files.
EXACT = 2e-5


def run(*arguments: object) -> None:
    assert main([str(a) for a in arguments]) == 0


# Shots that were made, by the bytes that they are made of: the same command writes the same file.
_made: dict[tuple[bytes, ...], bytes] = {}


def shoot(folder: Path) -> Path:
    """Make the shot of a folder's rig, take and binding."""
    shot, rig, take, places = (
        folder / name for name in ("shot.usda", "rig.usda", "take.usda", "bind.json")
    )
    bind = ["--bind", places] if places.exists() else []
    sources = tuple(path.read_bytes() for path in (rig, take, *bind[1:]))
    key = tuple(hashlib.sha256(data).digest() for data in sources)
    if key in _made:
        shot.write_bytes(_made[key])
        return shot
    run("shot", "--rig", rig, "--take", take, *bind, "-o", shot)
    _made[key] = shot.read_bytes()
    return shot


def process(folder: Path, *options: object) -> Path:
    """Make the shot if it is not there and process it; return the result's root."""
    shot = folder / "shot.usda"
    run("process", shot if shot.exists() else shoot(folder), *options)
    return folder / "shot.usdface.usda"


def digests(folder: Path) -> dict[str, str]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def solved(root: Path, world: World) -> np.ndarray:
    """The weights below the express layer, in the order of the world's shapes."""
    return animation_of(root, muted="express.usdc").reordered(world.rig.shape_names).weights


def report(folder: Path, *arguments: object) -> dict[str, object]:
    """What a command reports."""
    run(*arguments, "--report", folder / "report.json")
    return json.loads((folder / "report.json").read_text())


def codes_in(outcome: dict[str, object]) -> set[str]:
    return {finding["code"] for finding in outcome["findings"]}


@dataclass(frozen=True)
class Done:
    """A processed shot that tests only read."""

    world: World
    folder: Path
    root: Path
    before: dict[str, str]


def processed_world(folder: Path) -> Done:
    """Make the world's shot in a folder and process it."""
    world = make_world()
    shoot(world.write(folder))
    before = digests(folder)
    return Done(world, folder, process(folder), before)


def without_animation(folder: Path) -> Path:
    """Take the SkelAnimation and all that names it out of a folder's rig."""
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    for prim in stage.Traverse():
        prim.RemoveProperty("skel:animationSource")
    stage.RemovePrim("/Asset/Face/Anim")
    stage.Save()
    return folder
