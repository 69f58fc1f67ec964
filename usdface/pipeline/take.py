"""Conversion of a recorded take to USD: `usdface take`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.atomic import StrPath, all_or_none
from usdface.io.images.sequence import is_pattern, may_be_images
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.files import read_take
from usdface.io.takes.formats import TAKE_READERS
from usdface.io.usd.take import write_take
from usdface.options import TakeOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.takes import MarkerTake, WeightsTake

if TYPE_CHECKING:
    from usdface.io.images.footage import Footage

__all__ = ["make_take"]


@one_blas_thread()
def make_take(
    source: StrPath,
    output: StrPath,
    *,
    options: TakeOptions = TakeOptions(),
    sheet: StrPath | None = None,
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
    sheet : path, optional
        Of images: a picture of every n-th one with its labelled dots, .png, .svg or .pdf.
    on_progress : callable, optional

    Returns
    -------
    Result of MarkerTake or WeightsTake
        Keys of the summary: ``frames``, ``duration_s``, ``rate_hz``; of markers ``markers``,
        ``dimension``, ``occluded_percent``; of images ``channel``, ``reference_frame``,
        ``confidence_mean``; of weights ``blend_shapes``.

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
    drawn = None if sheet is None else Path(sheet)
    progress = Progress.of(on_progress)
    beside = [Path(each) for each in (options.names, options.fixes) if each]
    check_outputs([output, drawn], files_read(source, *beside))
    if drawn:
        _check_sheet(source, drawn)
    take: MarkerTake | WeightsTake
    footage = None
    with progress.step("read"):
        if is_pattern(source) or may_be_images(source):
            take, footage, findings = _read_images(source, options)
        else:
            take, findings = read_take(source, options)
    with progress.step("write"), all_or_none():
        if drawn and footage:
            from usdface.figures.footage_sheet import write_footage_sheet

            write_footage_sheet(footage, drawn)
        write_take(take, output)
    return Result(
        take,
        (output, *([drawn] if drawn else [])),
        tuple(findings),
        _summary(take) | (footage.summary if footage else {}),
        details=footage.details if footage else {},
        seconds=progress.seconds,
    )


def _check_sheet(source: Path, sheet: Path) -> None:
    from usdface.figures.picture import check_picture

    check_picture(sheet)
    if not (is_pattern(source) or may_be_images(source)):
        raise InputError(
            f"{source}: a sheet is drawn of images only; leave it out", "SETTING_WRONG"
        )


def _read_images(source: Path, options: TakeOptions) -> tuple[MarkerTake, "Footage", list[Finding]]:
    from usdface.io.images.footage import read_footage  # loads OpenImageIO only here

    TAKE_READERS.find(source)[0].format.check_options(source, options)
    return read_footage(source, options)


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
