"""Text files of rows and cells, as exporters and spreadsheets write them."""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import TypeAlias

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = [
    "Row",
    "delimiter_of",
    "nameless_columns",
    "positive",
    "read_numbers",
    "read_rows",
    "read_table",
    "read_text",
    "refuse_cut_end",
    "refuse_cut_table",
]

Row: TypeAlias = tuple[int, list[str]]  # line number from 1, cells without outer blanks

_LARGEST = 1 << 30  # bytes
_MISSING = frozenset({"", "na", "n/a", "nan", "null", "none", "-"})
# NaN as programs in C++ on Windows print it, since 2015 and before.
_PRINTED_NAN = re.compile(r"-?(nan\((ind|snan)\)|1\.#(ind|qnan|snan)0*)", re.IGNORECASE)


def read_text(path: Path) -> str:
    """Return the text of a file, without byte order mark.

    Raises
    ------
    InputError
        If it is missing, unreadable, empty, too large or not text.
    """
    if not path.is_file():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    if path.stat().st_size > _LARGEST:
        raise InputError(
            f"{path} is larger than {_LARGEST >> 30} GiB; expected a take: cut it into parts",
            "TOO_LARGE",
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}", "FILE_UNREADABLE") from error
    if b"\0" in data:
        raise InputError(f"{path} is not a text file; expected UTF-8 text", "FILE_UNREADABLE")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if not text.strip():
        raise InputError(f"{path} is empty; export or copy it again", "FILE_UNREADABLE")
    return text


def delimiter_of(text: str) -> str:
    """Return the separator of cells in a table's first line: comma, semicolon or tab.

    Spreadsheets write back a table of commas with semicolons where the comma is a decimal sign.
    """
    return max(",;\t", key=text.lstrip().splitlines()[0].count)


def read_rows(path: Path, text: str, delimiter: str) -> list[Row]:
    """Return the rows of a delimited text in which something is written; one at least.

    Raises
    ------
    InputError
        If the text cannot be split, or nothing is written in it.
    """
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=delimiter)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except csv.Error as error:
        raise InputError(
            f"{path}, line {reader.line_num}: {error}; "
            "expected a table with cells in quotes closed",
            "ROW_WRONG",
        ) from error
    written = [row for row in rows if any(row[1])]
    if not written:
        raise InputError(f"{path}: all cells are empty; expected a table", "ROW_WRONG")
    return written


def read_table(path: Path) -> list[Row]:
    """Return the rows of a table with commas, semicolons or tabs.

    Raises
    ------
    InputError
        If the file is missing, unreadable, no table, or cut off.
    """
    text = read_text(path)
    rows = read_rows(path, text, delimiter_of(text))
    refuse_cut_table(path, rows)
    return rows


def read_numbers(path: Path, rows: Sequence[Row], columns: Sequence[int]) -> FloatArray:
    """Return the cells of some columns as numbers: (rows, columns); nothing written = NaN.

    Raises
    ------
    InputError
        If a cell holds something else; the message names line and cell.
    """
    width = max(columns, default=-1) + 1
    full = (
        cells if len(cells) >= width else cells + [""] * (width - len(cells)) for _, cells in rows
    )
    picked = chain.from_iterable([cells[c] or "nan" for c in columns] for cells in full)
    count = len(rows) * len(columns)
    try:
        flat = np.fromiter(map(float, picked), np.float64, count)
    except ValueError:
        flat = np.fromiter(_parse_cells(path, rows, columns), np.float64, count)
    return flat.reshape(len(rows), len(columns))


def refuse_cut_table(path: Path, rows: Sequence[Row]) -> None:
    """Refuse a table whose last row has fewer cells than the first, the header.

    The last number of that row may be cut, too: a position that is wrong without a trace.

    Raises
    ------
    InputError
        If it is so; the message names the line.
    """
    (_, header), (line, cells) = rows[0], rows[-1]
    if len(cells) < len(header):
        raise InputError(
            f"{path}, line {line}: {len(cells)} cells; expected {len(header)}, as many as columns. "
            "The file is cut off; export or copy it again, or delete this line",
            "FILE_CUT_OFF",
        )


def refuse_cut_end(path: Path, text: str, last: Row, width: int, rows_missing: bool) -> None:
    """Refuse a table that ends within its last row, where a header announces how many there are.

    Two of three signs tell: the last row has fewer cells than columns, it has no line end, rows are
    missing. One alone is usual: programs leave out empty cells at the end of a row, editors the
    last line end, and recordings are stopped.

    Raises
    ------
    InputError
        If it is so; the message names the line.
    """
    line, cells = last
    signs = [f"{len(cells)} of {width} cells"] if len(cells) < width else []
    if not text.rstrip(" \t").endswith(("\n", "\r")):
        signs.append("no line end")
    if rows_missing:
        signs.append("fewer rows than the header announces")
    if len(signs) > 1:
        raise InputError(
            f"{path}, line {line}: {', '.join(signs)}. The file is cut off within this row; export "
            "or copy it again, or delete this line",
            "FILE_CUT_OFF",
        )


def nameless_columns(header: Sequence[str], rows: Sequence[Row]) -> int:
    """Return how many columns have something written below, and no name in the header."""
    widest = max((len(cells) for _, cells in rows), default=0)
    names = [*header, *[""] * (widest - len(header))]
    nameless = [column for column, name in enumerate(names) if not name]
    return sum(
        any(len(cells) > column and cells[column] for _, cells in rows) for column in nameless
    )


def positive(text: str) -> float:
    """Return a positive finite number, or 0 where the text is none."""
    try:
        value = float(text)
    except ValueError:
        return 0.0
    return value if np.isfinite(value) and value > 0 else 0.0


def _parse_cells(path: Path, rows: Sequence[Row], columns: Sequence[int]) -> Iterator[float]:
    """Yield numbers one by one: slower, but accepts words for missing values and names the line."""
    for line, cells in rows:
        for column in columns:
            cell = cells[column] if column < len(cells) else ""
            if cell.lower() in _MISSING:
                yield np.nan
                continue
            try:
                yield float(cell)
            except ValueError as error:
                if _PRINTED_NAN.fullmatch(cell):
                    yield np.nan
                    continue
                comma = "; write decimals with a point" if "," in cell else ""
                raise InputError(
                    f"{path}, line {line}, column {column + 1}: {cell[:40]!r} is not a number"
                    f"{comma}",
                    "ROW_WRONG",
                ) from error
