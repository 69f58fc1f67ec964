"""Conversion of a recorded take to USD: `usdface take`."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.figures.picture import check_picture
from usdface.findings import Finding
from usdface.io.atomic import StrPath, all_or_none
from usdface.io.images.sequence import is_pattern, may_be_images
from usdface.io.inputs import check_outputs, files_read
from usdface.io.overwrite_protection import check_replaced
from usdface.io.takes.camera_views import read_views
from usdface.io.takes.field_of_view import report_field_of_view
from usdface.io.takes.files import read_take
from usdface.io.takes.formats import TAKE_READERS
from usdface.io.usd.save_layers import check_usd_name
from usdface.io.usd.take_write import write_take
from usdface.options import TakeOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.takes import MarkerTake, WeightsTake

if TYPE_CHECKING:
    from usdface.io.images.footage import Footage

__all__ = ["make_take"]


@checked
@one_blas_thread()
def make_take(
    source: StrPath | Sequence[StrPath],
    output: StrPath,
    *,
    cameras: StrPath | None = None,
    sync: Sequence[int] = (),
    options: TakeOptions = TakeOptions(),
    sheet: StrPath | None = None,
    overwrite: bool = False,
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
    sheet : path, optional
        Of images: a picture of every n-th one with its labelled dots, .png, .svg or .pdf.
    overwrite : bool
        Replace `output` also where it is no take that usdface wrote.
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
    output = Path(output)
    sources = [Path(source)] if isinstance(source, str | PathLike) else [Path(s) for s in source]
    calibration = None if cameras is None else Path(cameras)
    _check_sources(sources, calibration, sync)
    drawn = None if sheet is None else Path(sheet)
    progress = Progress.of(on_progress)
    beside = [Path(each) for each in _other_files(options) if each]
    check_usd_name(output)
    check_outputs([output, drawn], files_read(*sources, calibration, *beside))
    check_replaced([(output, "take")], overwrite)
    filmed = is_pattern(sources[0]) or may_be_images(sources[0])
    if drawn:
        _check_sheet(sources, drawn, filmed)
    take: MarkerTake | WeightsTake
    footage = None
    with progress.step("read"):
        if calibration is not None:
            take, findings = read_views(sources, calibration, options, sync)
        elif filmed:
            take, footage, findings = _read_images(sources[0], options)
            findings += report_field_of_view(take, sources[0])
        else:
            take, findings = read_take(sources[0], options)
    with progress.step("write"), all_or_none():
        if drawn and footage:
            from usdface.figures.footage_sheet import write_footage_sheet

            write_footage_sheet(footage, drawn)
        write_take(take, output)
    summary = _summary(take)
    if footage:
        focal = take.focal_length if isinstance(take, MarkerTake) else 0.0
        summary |= footage.summary | {"focal_px": round(focal, 1) or None}
    return Result(
        take,
        (output, *([drawn] if drawn else [])),
        tuple(findings),
        summary,
        details=footage.details if footage else {},
        seconds=progress.seconds,
    )


def _other_files(options: TakeOptions) -> tuple[StrPath | None, ...]:
    return options.names, options.fixes, options.bind, options.rig


def _check_sources(sources: list[Path], calibration: Path | None, sync: Sequence[int]) -> None:
    if len(sources) == 1 and calibration is not None:
        raise InputError(
            f"{sources[0]} is the take of one camera; --cameras needs those of two or more, or "
            "is left out",
            "SETTING_WRONG",
        )
    if not sources or (len(sources) > 1 and calibration is None):
        images = bool(sources) and all(map(may_be_images, sources))
        hint = "; one film is named by its pattern in quotes, 'face.####.png'" if images else ""
        raise InputError(
            f"{len(sources)} takes and no calibration of cameras; "
            f"expected one take, or several with --cameras FILE{hint}",
            "SETTING_WRONG",
        )
    if sync and calibration is None:
        raise InputError("--sync is of several cameras; leave it out", "SETTING_WRONG")


def _check_sheet(sources: list[Path], sheet: Path, filmed: bool) -> None:
    check_picture(sheet)
    if not filmed or len(sources) > 1:
        raise InputError(
            f"{sources[0]}: a sheet is drawn of the images of one film only; leave it out",
            "SETTING_WRONG",
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
        occluded = 1.0 - float(take.visible.mean())
        return summary | {
            "markers": len(take.names),
            "dimension": take.dimension,
            "occluded_percent": round(100 * occluded, 2),
        }
    return summary | {"blend_shapes": len(take.names)}
