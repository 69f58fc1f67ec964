"""The take formats of usdface, each read by the module that is named after it.

Loads no library, so that help texts can list them.
"""

from collections.abc import Callable
from pathlib import Path

from usdface.errors import InputError
from usdface.formats import TakeReader
from usdface.io.format_table import FormatTable
from usdface.lazy import lazy_function

__all__ = ["TAKE_READERS"]

_MARKER_OPTIONS = ("units", "up_axis", "rate", "dimension", "image_size", "focal_length")
_TEXT_TABLES = (".csv", ".tsv", ".txt")
_FIRST_BYTES = 256  # more than the longest first words below


def _begins_with(words: str) -> Callable[[Path], bool]:
    """Return a test for text files whose first words these are, in capitals or not."""

    def begins(path: Path) -> bool:
        try:
            with path.open("rb") as file:
                first = file.read(_FIRST_BYTES).decode("utf-8-sig", errors="replace")
        except OSError as error:
            raise InputError(
                f"{path} cannot be read: {error.strerror}", "FILE_UNREADABLE"
            ) from error
        return first.lstrip().lower().startswith(words)

    return begins


def _reader(
    name: str,
    suffixes: tuple[str, ...],
    function: str,
    options: tuple[str, ...] = _MARKER_OPTIONS,
    first_words: str = "",
) -> TakeReader:
    return TakeReader(
        name=name,
        suffixes=suffixes,
        options=options,
        sniff=_begins_with(first_words) if first_words else None,
        read=lazy_function(f"usdface.io.takes.{function.removeprefix('read_')}", function),
    )


TAKE_READERS = FormatTable(
    TakeReader,
    "usdface.takes",
    ("take files", "read"),
    (
        _reader("C3D", (".c3d",), "read_c3d"),
        _reader("TRC", (".trc",), "read_trc"),
        _reader("BVH", (".bvh",), "read_bvh"),
        _reader("marker CSV", _TEXT_TABLES, "read_csv_markers"),
        _reader("Motive CSV", _TEXT_TABLES, "read_motive", first_words="format version,"),
        _reader(
            "Live Link Face CSV",
            _TEXT_TABLES,
            "read_livelink",
            options=("rate",),
            first_words="timecode,blendshapecount",
        ),
        _reader("TRC as CSV", _TEXT_TABLES, "read_trc", first_words="pathfiletype"),
        _reader("USD", (".usd", ".usda", ".usdc"), "read_usd_take", options=()),
    ),
)
