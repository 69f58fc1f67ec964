"""Contact sheets of real takes on heads: `python -m benchmarks.pictures OUT --help`."""

import argparse
import tempfile
import time
from pathlib import Path

from benchmarks.pictures.ict_materials import with_ict_materials
from benchmarks.pictures.rendering import pictures
from benchmarks.pictures.sheet import draw_sheets
from benchmarks.pictures.shots import HEADS, TAKES, played
from usdface.figures.peak_frames import peak_frames

__all__ = ["main"]


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.pictures",
        description="Real takes at their peaks: markers, raw solve, corrected face.",
    )
    parser.add_argument("output", type=Path, metavar="OUT", help="folder for the sheets")
    parser.add_argument("--takes", nargs="+", choices=TAKES, default=list(TAKES))
    parser.add_argument("--heads", nargs="+", choices=HEADS, default=list(HEADS))
    parser.add_argument(
        "--blender", type=Path, metavar="PYTHON", help="a Python with bpy renders the faces"
    )
    parser.add_argument(
        "--frames",
        type=int,
        nargs="+",
        metavar="N",
        help="frame indices in place of the peaks that are found",
    )
    parser.add_argument(
        "--proposed",
        action="store_true",
        help="places of the markers as usdface proposes them, not those set by hand",
    )
    parsed = parser.parse_args()
    parsed.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        shots = played(parsed.takes, parsed.heads, Path(folder), proposed=parsed.proposed)
        for take, head, result in shots:
            begin = time.perf_counter()
            frames = {n: "asked for" for n in parsed.frames or ()} or peak_frames(result)
            rows, rig = list(frames), result.shot.rig
            if head == "ict":
                rig = with_ict_materials(rig)
            raw, corrected = (
                pictures(rig, weights.names, weights.weights[rows], parsed.blender)
                for weights in (result.solved, result.weights)
            )
            path = parsed.output / f"{take}_{head}"
            written = draw_sheets(f"{take} on {head}", result, frames, raw, corrected, path)
            seconds = time.perf_counter() - begin
            print(f"{take} on {head}: {len(frames)} frames, {seconds:.0f} s")
            for sheet in written:
                print(f"wrote {sheet}")


if __name__ == "__main__":
    main()
