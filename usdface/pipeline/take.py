"""Conversion of a recorded take to USD: `usdface take`."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.io.atomic import StrPath
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.camera_views import read_views
from usdface.io.takes.files import read_take
from usdface.io.usd.take import write_take
from usdface.options import TakeOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["make_take"]


@one_blas_thread()
def make_take(
    source: StrPath | Sequence[StrPath],
    output: StrPath,
    *,
    cameras: StrPath | None = None,
    sync: Sequence[int] = (),
    options: TakeOptions = TakeOptions(),
    on_progress: OnProgress | None = None,
) -> Result[MarkerTake | WeightsTake]:
    """Convert a take of any format that `list_formats` names to USD.

    Parameters
    ----------
    source : path, or sequence of paths
        Several: 2D takes of one performance by calibrated cameras, in their order.
    output : path
        .usda or .usdc.
    cameras : path, optional
        Calibration of the cameras of several takes: .yml or .json of OpenCV, or .toml.
    sync : sequence of int
        A frame of each camera's footage, all of one moment; empty = footages begin together.
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
    output = Path(output)
    sources = [Path(source)] if isinstance(source, str | PathLike) else [Path(s) for s in source]
    calibration = None if cameras is None else Path(cameras)
    if not sources or (len(sources) > 1) != (calibration is not None):
        raise InputError(
            f"{len(sources)} takes and {'a' if calibration else 'no'} calibration of cameras; "
            "expected one take, or several with --cameras FILE",
            "SETTING_WRONG",
        )
    progress = Progress.of(on_progress)
    check_outputs([output], files_read(*sources, calibration))
    with progress.step("read"):
        take: MarkerTake | WeightsTake
        if calibration is None:
            take, findings = read_take(sources[0], options)
        else:
            take, findings = read_views(sources, calibration, options, sync)
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
