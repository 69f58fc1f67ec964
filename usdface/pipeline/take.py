"""Conversion of a recorded take to USD: `usdface take`."""

from pathlib import Path
from typing import Any

from usdface.blas_threads import one_blas_thread
from usdface.io.atomic import StrPath
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.files import read_take
from usdface.io.usd.take import write_take
from usdface.options import TakeOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["make_take"]


@one_blas_thread()
def make_take(
    source: StrPath,
    output: StrPath,
    *,
    options: TakeOptions = TakeOptions(),
    on_progress: OnProgress | None = None,
) -> Result[MarkerTake | WeightsTake]:
    """Convert a take of any format that `list_formats` names to USD.

    Parameters
    ----------
    source : path
    output : path
        .usda or .usdc.
    options : TakeOptions
        Unit, up axis and rate in place of the file's own.
    on_progress : callable, optional

    Returns
    -------
    Result of MarkerTake or WeightsTake
        Keys of the summary: ``frames``, ``duration_s``, ``rate_hz``; of markers ``markers``,
        ``dimension``, ``occluded_percent``; of weights ``blend_shapes``.

    Raises
    ------
    InputError
        If the source is no take.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> usdface.make_take("examples/performance.trc", "take.usdc").summary["rate_hz"]
    60.0
    """
    source, output = Path(source), Path(output)
    progress = Progress.of(on_progress)
    check_outputs([output], files_read(source))
    with progress.step("read"):
        take, findings = read_take(source, options)
    with progress.step("write"):
        write_take(take, output)
    return Result(take, (output,), tuple(findings), _summary(take), seconds=progress.seconds)


def _summary(take: MarkerTake | WeightsTake) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "frames": len(take.times),
        "duration_s": round(float(take.times[-1]), 3),
        "rate_hz": round(take.rate, 3),
    }
    if isinstance(take, MarkerTake):
        hidden = 1.0 - float(take.visible.mean())
        return summary | {
            "markers": len(take.names),
            "dimension": take.dimension,
            "occluded_percent": round(100 * hidden, 2),
        }
    return summary | {"blend_shapes": len(take.names)}
