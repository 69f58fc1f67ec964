"""Make the files of this folder again: ``python -m examples.make_example`` from the project.

The rig and the take are written here; the stages that the tool makes of them follow by its
own commands (`make_stages`).
"""

import argparse
from pathlib import Path

import numpy as np

from examples.expressions import EMOTIONS
from examples.head import build_head
from examples.performance import NEUTRAL, binding, perform
from examples.png import write_png
from usdface.cli import main as usdface
from usdface.figures.render import View
from usdface.figures.rig_picture import render_rig
from usdface.io.atomic import write_text
from usdface.io.bind_file import bind_json
from usdface.io.usd.rig_write import write_rig
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["bind_text", "main", "make_picture", "make_sources", "make_stages", "trc_text"]

FOLDER = Path(__file__).resolve().parent


def trc_text(take: MarkerTake, name: str) -> str:
    """Return a take as the text of a TRC file [mm], two decimals, empty cells = occluded."""
    count, markers = take.positions.shape[:2]
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    rate = f"{take.rate:.2f}"
    values = (rate, rate, str(count), str(markers), "mm", rate, "1", str(count))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "\t".join([*keys.split(), "OrigNumFrames"]),
        "\t".join(values),
        "Frame#\tTime\t" + "\t\t\t".join(take.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{m + 1}" for m in range(markers) for axis in "XYZ"),
        "",
    ]
    for frame, (time, row) in enumerate(zip(take.times, take.positions, strict=True)):
        cells = ("" if x != x else f"{1000 * x:.2f}" for x in row.ravel().tolist())
        lines.append("\t".join([str(frame + 1), f"{time:.6f}", *cells]))
    return "\n".join(lines) + "\n"


def bind_text() -> str:
    """Return the binding of the take's markers to the head, as bind.json."""
    return bind_json(RetargetSetup(binding(), neutral=NEUTRAL, nose_tip="nose_tip"))


def make_sources(folder: Path) -> None:
    """Write the rig, the take and the binding: head.usdc, performance.trc, bind.json."""
    write_rig(build_head(), folder / "head.usdc")
    write_text(folder / "performance.trc", trc_text(perform().take, "performance.trc"))
    write_text(folder / "bind.json", bind_text())


def make_stages(folder: Path) -> None:
    """Write what the commands make of the sources: take.usdc and shot.usda."""
    rig, take, bind = folder / "head.usdc", folder / "take.usdc", folder / "bind.json"
    convert = ("take", folder / "performance.trc", "-o", take)
    shot = ("shot", "--rig", rig, "--take", take, "--bind", bind)
    shot = (*shot, "--overwrite", "-o", folder / "shot.usda")
    for command in (convert, shot):
        if status := usdface([str(word) for word in command]):
            raise SystemExit(status)


def make_picture(folder: Path) -> None:
    """Write emotions.png: neutral and the six emotions, from the front and from the side."""
    rows = []
    for yaw in (0, 35):
        view = View(yaw=yaw, pitch=3, centre=(0, -0.005, 0), height=0.29, size=(170, 205))
        poses = ({}, *EMOTIONS.values())
        rows.append(np.hstack([render_rig(build_head(), pose, view) for pose in poses]))
    write_png(np.vstack(rows), folder / "emotions.png")


def main() -> None:
    """Write everything to this folder, or to another one."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER)
    folder = parser.parse_args().folder
    make_sources(folder)
    make_stages(folder)
    make_picture(folder)


if __name__ == "__main__":
    main()
