"""Another face than the performer's: `python -m benchmarks.stylised`.

Real range-of-motion weights drive a performer, the ICT face bent at random; the character is
the ICT face bent otherwise and more, its shapes carried by the Jacobian of the bend. Which
space map gives the weights back best, as `usdface process` solves, and what the left-out markers
had said. See README.md.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.solve.faces import ROOT, Face, bent, ict
from usdface.arrays import FloatArray
from usdface.options import MapOptions, ProcessOptions
from usdface.retarget.solution import Solution
from usdface.rigs import Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake

DATA = ROOT.parent / "shared" / "data"
ONLY_SOLVED = ProcessOptions(express=False, closure=False)
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


def performed(face: Face, style: str, seed: int, truth: FloatArray, rate: float) -> MarkerTake:
    """Let another person perform; a face that is bent by nothing is the same one."""
    rng = np.random.default_rng(100 + seed)
    performer = face if style == "same" else bent(face, seed, *PERFORMER)
    strengths = rng.uniform(0.8, 1.25, (len(face.offsets), 1, 1))
    moved = np.tensordot(truth, strengths * performer.offsets, 1)
    played = 1.1 * (performer.neutral + moved)
    played += 3e-4 * rng.normal(size=played.shape)
    played[:3] = 1.1 * performer.neutral
    return MarkerTake(face.names, np.arange(len(truth)) / rate, played, rate)


def solved(take: MarkerTake, character: Face, options: MapOptions) -> Solution:
    binding = Binding(character.names, character.points)
    setup = RetargetSetup(binding, head="stabilised", neutral=(0, 2), map=options)
    shot = Shot(Rig("Face", (character.mesh,)), take, setup)
    solution = retarget(shot, options=ONLY_SOLVED).solution
    assert solution is not None
    return solution


def main() -> None:
    face = ict(DATA)
    truth = face.curves[::5].clip(0, 1)
    truth = np.concatenate([np.zeros((3, truth.shape[1])), truth])
    table = Table(title=f"weight RMS error, {len(truth)} frames, {PAIRS} pairs of faces")
    for column in ("bend", *MAPS, "left-out mm", "similarity's", "chosen"):
        table.add_column(column, justify="right")
    for style, bend in STYLES.items():
        answers: dict[str, list[Solution]] = {name: [] for name in MAPS}
        for seed in range(PAIRS):
            take = performed(face, style, seed, truth, face.rate / 5)
            character = bent(face, 50 + seed, *bend)
            for name, options in MAPS.items():
                answers[name].append(solved(take, character, options))
        errors = (
            np.mean([np.sqrt(np.mean((s.weights.weights - truth) ** 2)) for s in answers[name]])
            for name in MAPS
        )
        choices = [s.choice for s in answers["auto"]]
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
