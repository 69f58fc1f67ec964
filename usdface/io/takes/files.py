"""Takes from files, each by the reader of its format."""

from dataclasses import replace
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.images.sequence import is_pattern
from usdface.io.takes.field_of_view import report_field_of_view
from usdface.io.takes.formats import TAKE_READERS
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.timing import check_timecode
from usdface.io.takes.verify_take import verified_take
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_take"]

# Frames per second of a recorded face [Hz]: from a slow web camera to high-speed optical systems.
_USUAL_RATES = (8.0, 500.0)


def read_take(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read a take: C3D, TRC, BVH, CSV, USD, images of painted dots, or a format of another package.

    Parameters
    ----------
    path : Path
    options : TakeOptions
        Overrides of the file: units, up axis, rate, dimension, start timecode.

    Returns
    -------
    take : MarkerTake or WeightsTake
        `WeightsTake` from recorded blend shape weights (Live Link Face, a SkelAnimation).
    findings : list of Finding
        Losses, assumptions and occlusion.

    Raises
    ------
    InputError
        If there is no such file, its kind is not read, it cannot be used, its format does
        not follow one of the `options`, or its rate is not that of the start timecode.
    PluginError
        If the reader of another package fails, or returns something else than a take.
    """
    path = Path(path)
    if not (path.is_dir() or path.is_file() or is_pattern(path)):
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    reader, findings = TAKE_READERS.find(path)
    reader.format.check_options(path, options)
    result = reader.call(reader.format.read, path, options)
    if reader.origin:
        result = verified_take(reader, path, result)
    take, found = result
    if options.start_timecode:
        check_timecode(path, options.start_timecode, take.rate)
        take = replace(take, start_timecode=options.start_timecode)
        found = [each for each in found if each.code != "TIMECODE_ASSUMED"]
    unusual = _rate_findings(take, path, options.rate) + report_field_of_view(take, path)
    return take, findings + found + unusual


def _rate_findings(
    take: MarkerTake | WeightsTake, path: Path, named: float | None
) -> list[Finding]:
    """Report a rate at which no face is recorded: a time column may be wrong."""
    least, most = _USUAL_RATES
    if take.rate == 0.0 or least <= take.rate <= most:  # 0: a single frame
        return []
    message = "{rate_hz:g} Hz; {frames} frames last {seconds:.2g} s"
    if not named:
        message += "; if they were recorded at another rate, name it: --rate HZ"
    seconds = len(take.times) / take.rate
    return [finding("RATE_UNUSUAL", str(path), message, take.rate, len(take.times), seconds)]
