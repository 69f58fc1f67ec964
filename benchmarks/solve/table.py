"""The table: every world, every solver, and whether ours is the best."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.solve.baselines import BASELINES, SAME
from benchmarks.solve.faces import has_real_data
from benchmarks.solve.worlds import REST, World, worlds
from usdface.arrays import FloatArray
from usdface.options import ProcessOptions
from usdface.retarget.confidence import confidence_of, within_bounds
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solution import Solution
from usdface.retarget.solve_report import usual_misfit
from usdface.retarget.solver.regularisation import Regularisation
from usdface.rigs import Rig
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot

__all__ = ["measured"]

# Nearer than this is a draw.
DRAW = 1e-6
# A shape with less weight is not counted as used.
USED = 0.01


def ours(world: World) -> tuple[FloatArray, FloatArray]:
    """Return weights (F, S), and the standard deviations that are said of them (S,).

    As `usdface process` does it: the markers are cleaned, and may sit beside their vertices.
    """
    shot = Shot(Rig("Face", (world.target.mesh,)), world.take, world.setup)
    result = retarget(shot, options=ProcessOptions(express=False, closure=False))
    assert result.solution is not None
    weights = result.solved.reordered(world.target.mesh.shape_names).weights
    return weights[REST:], deviations(world, result.solution)


def deviations(world: World, solution: Solution) -> FloatArray:
    """Return what `usdface.retarget.solve_report` says of each weight."""
    face, used = world.target, world.target.names
    sure = confidence_of(
        MotionModel.linear(face.neutral, face.offsets, world.still.shape[2], world.head_moves),
        np.array([used.index(name) for name in solution.markers]),
        1.0 / face.rate,
        Regularisation(
            solution.noise,
            usual_misfit(solution),
            world.setup.solve,
            covariance=solution.covariance,
        ),
    )
    return within_bounds(sure.deviations, solution.weights.weights)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def figures(world: World, weights: FloatArray, gram: FloatArray) -> dict[str, float]:
    """Return the metrics of one solver: weights, mesh and markers against the truth."""
    off = weights - world.truth
    offsets = world.target.offsets.reshape(off.shape[1], -1)
    rough = rms(np.diff(world.truth, 2, axis=0))
    said = {
        "weight rms": rms(off),
        "roughness / true": rms(np.diff(weights, 2, axis=0)) / max(rough, 1e-12),
        "mesh mm": 1000 * float(np.sqrt(np.einsum("fs,st,ft->f", off, gram, off).mean())),
        "marker mm": 1000 * float(np.sqrt(3.0) * rms(off @ offsets)),
        "cardinality": float((weights > USED).sum(axis=1).mean()),
        "L1 / true": float(np.abs(weights).sum() / world.truth.sum()),
        "outside bounds": float(((weights < 0) | (weights > 1)).mean()),
    }
    if world.target.lips:
        upper, lower = world.target.mesh.offsets_at(np.array(world.target.lips)).transpose(1, 0, 2)
        said["lip gap mm"] = 1000 * rms(off @ (upper - lower)[:, 1])
    return said


def measured(data: Path, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; plain values for JSON."""
    rows = []
    for world in worlds(data, quick):
        mesh = world.target.mesh
        moved = np.unique(np.concatenate([shape.indices for shape in mesh.shapes]))
        flat = mesh.offsets_at(moved).reshape(len(mesh.shapes), -1)
        gram = flat @ flat.T / len(moved)
        solvers = dict(BASELINES)
        if "2D" in world.name:  # the textbook map is into space
            solvers.pop("textbook RBF, exact")
        mine, said = ours(world)
        solved = {"ours": mine, **{name: solve(world) for name, solve in solvers.items()}}
        found = {name: figures(world, weights, gram) for name, weights in solved.items()}
        away = np.abs(mine - world.truth)
        found["ours"] |= {
            "within 1 sd": float((away <= said).mean()),
            "within 2 sd": float((away <= 2 * said).mean()),
        }
        if rms(away) > DRAW:  # else there is nothing to be unsure of
            found["ours"]["sd said / true"] = rms(said) / rms(away)
        for name in SAME:
            found[name]["from exact"] = float(np.abs(solved[name] - solved["exact"]).max())
        best = min(found, key=lambda name: found[name]["weight rms"])
        won = found["ours"]["weight rms"] <= found[best]["weight rms"] + DRAW
        rows.append({"world": world.name, "best": "ours" if won else best, "solvers": found})
    curves = "real data" if has_real_data(data) else "the example's head and curves"
    return {"curves": curves, "quick": quick, "rows": rows}
