"""One door for every take file: by suffix, and for CSV by what its first line says."""

from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.bvh import read_bvh
from usdface.io.takes.c3d import read_c3d
from usdface.io.takes.csv_markers import read_csv_markers
from usdface.io.takes.livelink import read_livelink
from usdface.io.takes.motive import read_motive
from usdface.io.takes.raw_take import DEFAULTS
from usdface.io.takes.trc import read_trc
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_take"]

_IMAGES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".bmp", ".mov", ".mp4"})


def read_take(
    path: Path, options: TakeOptions = DEFAULTS
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read a take: C3D, TRC, BVH, marker CSV (long, wide, Motive) or Live Link Face CSV.

    Parameters
    ----------
    path : Path
    options : TakeOptions
        What the file does not say, or says wrongly.

    Returns
    -------
    take : MarkerTake or WeightsTake
        A `WeightsTake` only from a Live Link Face recording.
    findings : list of Finding
        What was dropped, guessed or is hidden.

    Raises
    ------
    InputError
        If there is no such file, its kind is not read, or it cannot be used.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if path.is_dir() or suffix in _IMAGES:
        raise InputError(
            f"{path}: image sequences are not read in this version; "
            "track the markers first and give their positions as CSV",
            "FILE_KIND_UNKNOWN",
        )
    if not path.is_file():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    match suffix:
        case ".c3d":
            return read_c3d(path, options)
        case ".trc":
            return read_trc(path, options)
        case ".bvh":
            return read_bvh(path, options)
        case ".csv" | ".tsv" | ".txt":
            return _read_csv(path, options)
    raise InputError(
        f"{path}: take files of kind {suffix!r} are not read; expected .c3d, .trc, .bvh or .csv",
        "FILE_KIND_UNKNOWN",
    )


def _read_csv(path: Path, options: TakeOptions) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    try:
        with path.open("rb") as file:
            start = file.read(256).decode("utf-8-sig", errors="replace").lstrip().lower()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}", "FILE_UNREADABLE") from error
    if start.startswith("format version,"):
        return read_motive(path, options)
    if start.startswith("timecode,blendshapecount"):
        return read_livelink(path, options)
    if start.replace(" ", "").startswith("frame,timestamp,confidence,success"):
        raise InputError(
            f"{path}: OpenFace files are not read; name its columns A_x, A_y, A_z",
            "FILE_KIND_UNKNOWN",
        )
    if start.startswith("pathfiletype"):
        return read_trc(path, options)
    return read_csv_markers(path, options)
