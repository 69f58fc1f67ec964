"""A very long take as an Open Job Description bundle: estimates, pieces as tasks, their join."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.show.openjd_bundle import (
    LONGEST_NAME,
    USDFACE,
    bundle_documents,
    chunked,
    step,
    write_documents,
)

__all__ = ["write_pieces_bundle"]


def write_pieces_bundle(
    folder: Path,
    shot: Path,
    pieces: Path,
    *,
    count: int,
    chunk: int,
    options: Sequence[str],
    last: Sequence[str],
    inputs: Iterable[Path],
    outputs: Iterable[Path],
) -> tuple[Path, ...]:
    """Write the bundle of a take in pieces: template, parameter values, asset references.

    Parameters
    ----------
    folder : Path
    shot : Path
    pieces : Path
        The folder that they are kept in, which all workers reach.
    count : int
        Of the pieces.
    chunk : int
        Pieces in a task.
    options : sequence of str
        Words of the command line that every step has.
    last : sequence of str
        Those that the last has as well.
    inputs : iterable of Path
        All files that the shot reads.
    outputs : iterable of Path
        Folders that results are written to.

    Returns
    -------
    tuple of Path
        The files, the template first.

    Raises
    ------
    InputError
        If a word would be a format string of the template.
    """
    for word in (*options, *last):
        if "{{" in word:
            raise InputError(f"{word!r} cannot stand in a job: it has braces", "SETTING_WRONG")
    values: dict[str, str | int] = {
        "Shot": str(shot.resolve()),
        "Pieces": str(pieces.resolve()),
        "Chunk": chunk,
        "Indices": f"0-{count - 1}",
    }
    template = _template(f"usdface {shot.stem}"[:LONGEST_NAME], count, chunk, options, last)
    folders = sorted({str(path.resolve()) for path in (pieces, *outputs)})
    return write_documents(folder, bundle_documents(template, values, inputs, folders))


def _template(
    name: str, count: int, chunk: int, options: Sequence[str], last: Sequence[str]
) -> dict[str, Any]:
    common = ["process", "{{Param.Shot}}", "--pieces", "{{Param.Pieces}}", "--workers", "1"]
    common += [*options, "--progress", "openjd"]
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": name,
        "parameterDefinitions": [
            {
                "name": "Shot",
                "type": "PATH",
                "objectType": "FILE",
                "dataFlow": "IN",
                "description": "The shot.",
            },
            {
                "name": "Pieces",
                "type": "PATH",
                "objectType": "DIRECTORY",
                "dataFlow": "INOUT",
                "description": "The folder of estimates and pieces, which all workers reach.",
            },
            {
                "name": "Indices",
                "type": "STRING",
                "default": f"0-{count - 1}",
                "description": "Pieces, such as 0-9 or 3,7.",
            },
            {
                "name": "Chunk",
                "type": "INT",
                "minValue": 1,
                "default": chunk,
                "description": "Pieces in a task.",
            },
            USDFACE,
        ],
        "steps": [
            step("Estimates", [*common, "--piece", "estimates"]),
            step(
                "Pieces",
                [*common, "--piece", "{{Task.Param.Piece}}"],
                [chunked("Piece")],
                after="Estimates",
            ),
            step("Join", [*common, *last], after="Pieces"),
        ],
    }
