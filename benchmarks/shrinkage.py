"""Brows that the solve shrank: `python -m benchmarks.shrinkage`.

Takes of `benchmarks.solve` in which another person's shapes go other ways than the rig's, each
turned and stretched by so much (`anatomy`). The slope from solved to true weights in the brows and
in the mouth, the factor that `usdface.retarget.shrinkage` finds, and the RMS error of the brows'
weights and of all without and with it. See README.md.
"""

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.solve.faces import ROOT, Face, bent, ict, makehuman
from benchmarks.solve.worlds import PERFORMER, REST, SCORED, World, perform
from usdface.arrays import BoolArray, FloatArray
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.regions import shape_regions
from usdface.options import ProcessOptions, SolveShrinkage
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.shrinkage import brow_factor
from usdface.rigs import Rig
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot, ShotResult

DATA = ROOT.parent / "shared" / "data"
ANATOMIES, SEEDS = (0.1, 0.25, 0.5), (0, 1)
FRAMES = 1000
ONLY_SOLVED = ProcessOptions(express=False, closure=False)


def main() -> None:
    table = Table(title="another person's movements")
    for column in ("face", "anatomy", "head", "factor", "slope, brows", "mouth"):
        table.add_column(column, justify="right")
    for column in ("brows' error, kept", "restored", "all, kept", "restored"):
        table.add_column(column, justify="right")
    part = slice(SCORED.start, SCORED.start + FRAMES)
    for anatomy in ANATOMIES:
        for name, face in (("ICT", ict(DATA)), ("MakeHuman", makehuman(DATA))):
            for seed in SEEDS:
                performer = bent(face, seed, PERFORMER)
                world = perform(
                    name, face, seed=seed, performer=performer, head_moves=bool(seed),
                    anatomy=anatomy, part=part,
                )  # fmt: skip
                head = "moves" if seed else "still"
                table.add_row(name, f"{anatomy:g}", head, *row(face, world))
    Console(width=150).print(table)


def row(face: Face, world: World) -> list[str]:
    kept, restored = (solved(face, world, way) for way in ("kept", "restored"))
    regions = shape_regions(face.mesh, find_lip_lid_contacts(face.mesh))
    brows, mouth = (np.isin(kept.solved.names, regions[name]) for name in ("brows", "mouth"))
    solution = kept.solution
    assert solution is not None
    motion = MotionModel(solution.rest, solution.model, 3, world.head_moves)
    factor = brow_factor(solution.weights.weights, solution.displacements, motion, brows)
    weights = [result.solved.weights[REST:] for result in (kept, restored)]
    slopes = (slope(weights[0], world.truth, own) for own in (brows, mouth))
    errors = [rms((w - world.truth)[:, own]) for own in (brows, brows | True) for w in weights]
    return [f"{factor:.2f}", *(f"{s:.2f}" for s in slopes), *(f"{e:.3f}" for e in errors)]


def solved(face: Face, world: World, shrinkage: SolveShrinkage) -> ShotResult:
    setup = world.setup
    setup = replace(setup, solve=replace(setup.solve, shrinkage=shrinkage))
    return retarget(Shot(Rig("Face", (face.mesh,)), world.take, setup), options=ONLY_SOLVED)


def slope(weights: FloatArray, truth: FloatArray, own: BoolArray) -> float:
    """Return by how much weights (F, S) would have to be larger, in least squares."""
    at = weights[:, own]
    return float((at * truth[:, own]).sum() / (at**2).sum())


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
