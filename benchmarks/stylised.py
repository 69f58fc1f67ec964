"""Another face than the performer's: `python benchmarks/stylised.py`.

Real range-of-motion weights drive a performer, the ICT face bent at random; the character is
the ICT face bent otherwise and more, its shapes carried by the Jacobian of the bend. Which
space map gives the weights back best, and what the left-out markers had said. See README.md.
"""

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from usdface.arrays import FloatArray
from usdface.face.shape_names import rename_weights
from usdface.io.takes.files import read_take
from usdface.options import MapOptions
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.retarget_setup import Binding, RetargetSetup
from usdface.takes import MarkerTake

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh, landmarks  # noqa: E402

# RMS bend of a coordinate by one of eight bumps [m], and how wide they are [m].
STYLES = {
    "same": (0.0, 0.06),
    "slight": (0.004, 0.06),
    "half": (0.008, 0.06),
    "full": (0.015, 0.06),
    "broad": (0.03, 0.08),
}
PERFORMER = (0.004, 0.05)
MAPS = {
    "auto": MapOptions(),
    "radius 3, smoothing 1": MapOptions(choice="fixed"),
    "similarity": MapOptions(choice="fixed", smoothing=1e12),
    "paper": MapOptions(form="paper"),
}
PAIRS = 4


def bent(seed: int, points: FloatArray, size: float, width: float) -> tuple[FloatArray, FloatArray]:
    """Return points (M, 3) after a random smooth bend, and its Jacobian there (M, 3, 3)."""
    rng = np.random.default_rng(seed)
    centres = points[rng.integers(len(points), size=8)] + 0.02 * rng.normal(size=(8, 3))
    moves = size * rng.normal(size=(8, 3))
    away = points[:, None] - centres
    bumps = np.exp(-(away**2).sum(axis=2) / (2 * width**2))
    slopes = np.einsum("mk,kd,mke->mde", bumps, moves, -away / width**2)
    return points + bumps @ moves, np.eye(3) + slopes


def main() -> None:
    mesh, vertices = ict_mesh(SHARED), landmarks(SHARED)
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    truth = rename_weights(recorded, mesh.shape_names)[0].weights[::5].clip(0, 1)
    truth = np.concatenate([np.zeros((3, truth.shape[1])), truth])
    times, rate = 5 * np.arange(len(truth)) / recorded.rate, recorded.rate / 5
    face, offsets = mesh.points[vertices], mesh.offsets_at(vertices)
    names = tuple(f"landmark_{i}" for i in range(len(face)))
    binding = Binding(names, np.arange(len(face)))
    table = Table(title=f"weight RMS error, {len(truth)} frames, {PAIRS} pairs of faces")
    for column in ("bend", *MAPS, "left-out mm", "similarity's", "chosen"):
        table.add_column(column, justify="right")
    for style, bend in STYLES.items():
        solved: dict[str, list[Solution]] = {name: [] for name in MAPS}
        for seed in range(PAIRS):
            rng = np.random.default_rng(100 + seed)
            # The same face twice, then two faces.
            own = (0.0, PERFORMER[1]) if style == "same" else PERFORMER
            neutral, turn = bent(seed, face, *own)
            strengths = rng.uniform(0.8, 1.25, (len(offsets), 1, 1))
            moves = np.einsum("mde,sme->smd", turn, strengths * offsets)
            played = neutral + np.einsum("fs,smd->fmd", truth, moves)
            played = 1.1 * played + 3e-4 * rng.normal(size=played.shape)
            played[:3] = 1.1 * neutral
            take = MarkerTake(names, times, played, rate)
            character, turn = bent(50 + seed, face, *bend)
            shapes = np.einsum("mde,sme->smd", turn, offsets)
            for name, options in MAPS.items():
                setup = RetargetSetup(binding, head="stabilised", neutral=(0, 2), map=options)
                answer, _ = solve_take(take, character, shapes, mesh.shape_names, setup)
                solved[name].append(answer)
        errors = (
            np.mean([np.sqrt(np.mean((s.weights.weights - truth) ** 2)) for s in solved[name]])
            for name in MAPS
        )
        choices = [s.choice for s in solved["auto"]]
        table.add_row(
            style,
            *(f"{error:.4f}" for error in errors),
            f"{1000 * np.mean([c.error for c in choices]):.2f}",
            f"{1000 * np.mean([c.similarity_error for c in choices]):.2f}",
            choices[0].name,
        )
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
