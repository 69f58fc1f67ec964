"""The input files of docs/recipes.md: ``python -m examples.recipe_files FOLDER``.

Beside the example's own files: its performer's head as a folder of OBJ meshes, a second take of the
performer in which the face never rests, and the first take as a phone would have recorded it.
"""

import argparse
import shutil
from pathlib import Path

import numpy as np

from examples.expressions import EMOTIONS
from examples.head import build_head
from examples.make_example import FOLDER, trc_text
from examples.performance import bent_as_performer, perform, record
from usdface.arrays import FloatArray, IntArray
from usdface.io.atomic import write_text
from usdface.takes import WeightsTake

__all__ = ["main", "make_recipe_files", "obj_text", "phone_text", "smiling_weights"]

SMILE = 0.5  # of joy, all the time
TALK = slice(590, 700)  # frames of the first take in which the performer talks
SEED = 20250522


def obj_text(points: FloatArray, counts: IntArray, corners: IntArray) -> str:
    """Return points (V, 3) [m] and faces as OBJ in centimetres."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in (100 * points).tolist()]
    faces = np.split(corners + 1, np.cumsum(counts)[:-1])
    return "\n".join([*lines, *("f " + " ".join(map(str, face)) for face in faces)]) + "\n"


def phone_text(take: WeightsTake) -> str:
    """Return weights as the CSV of Live Link Face; the phone sees neither head nor eyes turn."""
    turns = [f"{part}{turn}" for part in ("Head", "LeftEye", "RightEye") for turn in _TURNS]
    names = [name[0].upper() + name[1:] for name in take.names]
    lines = [",".join(["Timecode", "BlendShapeCount", *names, *turns])]
    for time, row in zip(take.times.tolist(), take.weights.tolist(), strict=True):
        second, frame = divmod(round(time * take.rate), round(take.rate))
        clock = f"10:00:{second:02d}:{frame:02d}.000"
        cells = [*(f"{weight:.6f}" for weight in row), *["0"] * len(turns)]
        lines.append(",".join([clock, "61", *cells]))
    return "\n".join(lines) + "\n"


_TURNS = ("Yaw", "Pitch", "Roll")


def smiling_weights() -> FloatArray:
    """Return weights (F, S) of talk through a smile: the face never rests."""
    take = perform().weights
    weights = take.weights[TALK].copy()
    for name, weight in EMOTIONS["joy"].items():
        weights[:, take.names.index(name)] += SMILE * weight
    return np.clip(weights, 0, 1)


def make_recipe_files(folder: Path) -> None:
    """Write the example's files and those of the recipes to a folder."""
    for name in ("head.usdc", "performance.trc", "bind.json", "expressions/contempt.json"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(FOLDER / name, folder / name)
    head = build_head().mesh("head")
    (folder / "anna").mkdir(exist_ok=True)
    offsets = head.offsets_at(np.arange(len(head.points)))
    shown = dict(zip(head.shape_names, offsets, strict=True))
    for name, moved in {"neutral": np.zeros_like(head.points), **shown}.items():
        points = bent_as_performer(head.points + moved)
        text = obj_text(points, head.face_counts, head.face_indices)
        write_text(folder / "anna" / f"{name}.obj", text)
    times = np.arange(TALK.stop - TALK.start) / perform().take.rate
    smiling = record(smiling_weights(), times, np.random.default_rng(SEED))
    write_text(folder / "smiling.trc", trc_text(smiling, "smiling.trc"))
    write_text(folder / "phone.csv", phone_text(perform().weights))


def main() -> None:
    """Write the files to a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    make_recipe_files(parser.parse_args().folder)


if __name__ == "__main__":
    main()
