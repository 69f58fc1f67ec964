"""Draws docs/footage.png: the contact sheet of a rendered film.

``python docs/make_footage.py [FOLDER]`` from the project; the film is rendered into FOLDER (two
minutes) unless it is there.
"""

import sys
from pathlib import Path

import OpenImageIO as oiio

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.footage.film import (  # noqa: E402
    PHONE,
    example_film,
    shoot,
    swaying,
    temporary_folder,
)
from examples.performance import perform  # noqa: E402
from usdface import make_take  # noqa: E402
from usdface.options import TakeOptions  # noqa: E402

WIDTH, HEIGHT = 1000, 800  # px
FRAMES = slice(15, 135)  # of the example's performance, at 30 Hz


def main() -> None:
    """Render, track and draw."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else temporary_folder() / "documentation"
    weights = perform().weights
    chosen = weights.weights[::2][FRAMES]
    angles, shift = swaying(len(chosen), 30.0, 22.0)
    film = example_film(chosen, weights.names, angles, shift, hand=True)
    shoot(film, PHONE, folder)
    make_take(
        folder / "face.####.jpg",
        folder / "take.usdc",
        options=TakeOptions(rate=30.0),
        sheet=folder / "sheet.png",
    )
    picture = oiio.ImageBufAlgo.resize(
        oiio.ImageBuf(str(folder / "sheet.png")), roi=oiio.ROI(0, WIDTH, 0, HEIGHT, 0, 1, 0, 3)
    )
    picture.write(str(ROOT / "docs" / "footage.png"))


if __name__ == "__main__":
    main()
