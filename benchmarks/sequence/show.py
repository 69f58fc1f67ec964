"""A made show: the example head bent into three characters, its take into five performers."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.io.bind_file import read_bind
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.pipeline import make_shot
from usdface.pipeline.reading import read_take
from usdface.rigs import Rig
from usdface.takes import MarkerTake

__all__ = ["CHARACTERS", "PERFORMERS", "make_show"]

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples"
CHARACTERS, PERFORMERS = 3, 5
_NEUTRAL, _FADE = 24, 8  # frames of rest that each take begins with; of the passage to the motion
_NOISE = 2e-4  # m


def make_show(folder: Path, shots: int, frames: int, *, written: bool = True) -> Path:
    """Make a show file of so many shots of so many frames each; return it.

    Parameters
    ----------
    folder : Path
    shots, frames : int
    written : bool
        Also make the shots, which the show file then names as files.
    """
    folder.mkdir(parents=True)
    rig, _ = read_rig(EXAMPLE / "head.usdc")
    take, _ = read_take(EXAMPLE / "take.usdc")
    assert isinstance(take, MarkerTake)
    for character in range(CHARACTERS):
        write_rig(_bent(rig, character), folder / f"character_{character}.usdc")
    _write_bind(folder / "bind.json")
    (folder / "takes").mkdir()
    (folder / "shots").mkdir()
    entries = []
    for number in range(shots):
        performer, character = number % PERFORMERS, number % CHARACTERS
        name = f"shot_{number:03}"
        write_take(_cut(take, number, frames, performer), folder / f"takes/{name}.usdc")
        entry = {
            "name": name,
            "take": f"takes/{name}.usdc",
            "rig": f"character_{character}.usdc",
            "bind": "bind.json",
        }
        entries.append("[[shots]]\n" + "".join(f'{k} = "{v}"\n' for k, v in entry.items()))
        if written:
            files = (folder / entry["rig"], folder / entry["take"])
            make_shot(*files, folder / f"shots/{name}.usda", bind=folder / "bind.json")
    text = 'files = ["shots/*.usda"]\n' if written else 'folder = "shots"\n' + "".join(entries)
    (folder / "show.toml").write_text(text)
    return folder / "show.toml"


def _write_bind(path: Path) -> None:
    shutil.copy(EXAMPLE / "bind.json", path)
    setup, _ = read_bind(path)
    from usdface.io.bind_file import bind_json

    path.write_text(bind_json(replace(setup, neutral=(0, _NEUTRAL - _FADE - 1), peaks=())))


def _bent(rig: Rig, number: int) -> Rig:
    """Return the rig on another head: broader, longer or with a bent profile."""
    meshes = []
    for mesh in rig.meshes:
        points = mesh.points.copy()
        middle = points.mean(axis=0)
        points = (points - middle) * (1.0 + 0.08 * np.eye(3)[number]) + middle
        height = (points[:, 1] - middle[1]) / np.ptp(points[:, 1])
        points[:, 2] += 0.02 * number * height**2
        meshes.append(replace(mesh, points=points))
    return replace(rig, meshes=tuple(meshes))


def _cut(take: MarkerTake, number: int, frames: int, performer: int) -> MarkerTake:
    """Return a part of the take after some rest, on the face of a performer, with noise."""
    chance = np.random.default_rng(number)
    begin = int(chance.integers(_NEUTRAL, len(take.times) - frames))
    rest = take.positions[: _NEUTRAL - _FADE]
    part = take.positions[begin : begin + frames - _NEUTRAL]
    share = np.linspace(0.0, 1.0, _FADE + 2)[1:-1, None, None]
    passage = (1 - share) * rest[-1] + share * part[0]
    positions: FloatArray = np.concatenate([rest, passage, part])
    middle = np.nanmean(positions[0], axis=0)
    size = 1.0 + 0.04 * (performer - 2) * np.array([1.0, -0.5, 0.5])
    positions = (positions - middle) * size + middle
    positions = positions + _NOISE * chance.standard_normal(positions.shape)
    times = np.arange(len(positions)) / take.rate
    return replace(take, times=times, positions=positions)
