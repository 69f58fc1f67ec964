"""The table: every world, every solver, and whether ours is the best."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.solve.baselines import BASELINES
from benchmarks.solve.faces import has_real_data
from benchmarks.solve.worlds import REST, World, worlds
from usdface.cleanup.clean import clean_take
from usdface.retarget.transfer import solve_take
from usdface.takes import FloatArray

__all__ = ["measured"]

# Nearer than this is a draw.
DRAW = 1e-6


def ours(world: World) -> FloatArray:
    setup, face = world.setup, world.target
    cleaned, _ = clean_take(world.take, world.take.names, setup.clean, world.head_moves)
    take = cleaned.take
    # As the program does: what was filled in is not observed.
    positions = np.where(cleaned.measured[..., None], take.positions, np.nan)
    take = type(take)(take.names, take.times, positions, take.rate)
    solution, _ = solve_take(take, face.neutral, face.offsets, face.mesh.shape_names, setup)
    return solution.weights.weights[REST:]


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
        solvers = {"ours": ours, **BASELINES}
        if "2D" in world.name:  # the textbook map is into space
            solvers.pop("textbook RBF, exact")
        found = {name: figures(world, solve(world), gram) for name, solve in solvers.items()}
        best = min(found, key=lambda name: found[name]["weight rms"])
        won = found["ours"]["weight rms"] <= found[best]["weight rms"] + DRAW
        rows.append({"world": world.name, "best": "ours" if won else best, "solvers": found})
    curves = "real data" if has_real_data(data) else "the example's head and curves"
    return {"curves": curves, "quick": quick, "rows": rows}
