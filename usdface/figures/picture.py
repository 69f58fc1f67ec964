"""Picture files of figures (matplotlib): validates the file name first, writes atomically."""

import io
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from usdface.errors import InputError, how_to_install
from usdface.io.atomic import write_bytes

__all__ = ["check_picture", "save_figure"]

_SUFFIXES = (".png", ".svg", ".pdf")


def save_figure(draw: Callable[[Any], None], path: Path) -> None:
    """Draw a figure and write it; the same figure gives the same bytes.

    Raises
    ------
    InputError
        If matplotlib is not installed, or the suffix is not .png, .svg or .pdf.
    OutputError
        If the file cannot be written.
    """
    check_picture(path)
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    draw(figure)
    drawn = io.BytesIO()
    # Without date and random names, so that the same take gives the same bytes.
    metadata = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    suffix = path.suffix.lower()
    with rc_context({"svg.hashsalt": "usdface"}):
        figure.savefig(drawn, format=suffix[1:], dpi=110, metadata=metadata[suffix])
    write_bytes(path, drawn.getvalue())


def check_picture(path: Path | None) -> None:
    """Refuse an unknown picture format, or a missing matplotlib, before any work; None is neither.

    Raises
    ------
    InputError
        If the file name ends in none of the formats, or matplotlib is not installed.
    """
    if path is None:
        return
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(
            f"{path} is no picture; end it in {', '.join(_SUFFIXES)}", "FILE_KIND_UNKNOWN"
        )
    if find_spec("matplotlib") is None:
        raise InputError(f"figures need matplotlib: {how_to_install('plot')}")
