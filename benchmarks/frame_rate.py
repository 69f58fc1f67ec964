"""Weights at half the frame rate, on real takes: `python benchmarks/frame_rate.py`.

The weights of AnimFace's takes, solved from all frames and from every second one, are compared at
the frames that both have.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
import usdface  # noqa: E402
from benchmarks.pictures.shots import HEADS, TAKES, bind_file, head_file  # noqa: E402
from usdface.arrays import FloatArray  # noqa: E402

REAL = ("jaw", "eyebrows")


def weights(
    rig: usdface.Rig, take: usdface.MarkerTake, setup: usdface.RetargetSetup | None
) -> FloatArray:
    shot, _ = usdface.assemble_shot(rig, take, setup=setup)
    return usdface.retarget(shot, options=usdface.ProcessOptions(express=False)).solved.weights


def every_second(take: usdface.MarkerTake) -> usdface.MarkerTake:
    return replace(take, positions=take.positions[::2], times=take.times[::2], rate=take.rate / 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split(":")[0])
    parser.add_argument("--heads", nargs="+", choices=HEADS, default=["ict"])
    parsed = parser.parse_args()
    table = Table("take, head", "places", "RMS difference", "largest")
    with tempfile.TemporaryDirectory() as folder:
        for head in parsed.heads:
            rig, _ = usdface.read_rig(head_file(head, Path(folder)))
            for name in REAL:
                take, _ = usdface.read_take(TAKES[name])
                by_hand, _ = usdface.read_bind(bind_file(name, head))
                start, end = by_hand.neutral
                halved = replace(by_hand, neutral=(start // 2, end // 2))
                for places, of_whole, of_half in (
                    ("set by hand", by_hand, halved),
                    ("proposed", None, None),
                ):
                    half = weights(rig, every_second(take), of_half)
                    apart = weights(rig, take, of_whole)[::2] - half
                    rms, largest = np.sqrt(np.mean(apart**2)), np.abs(apart).max()
                    table.add_row(f"{name}, {head}", places, f"{rms:.3f}", f"{largest:.2f}")
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
