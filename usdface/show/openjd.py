"""A sequence as an Open Job Description bundle: a job that any manager with OpenJD runs.

A task is a place in the list of shots, since lists of texts end at 1,024 entries and only integers
come in chunks.
"""

import os
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
from usdface.show.plan import ShotPlan
from usdface.show.show_json import show_json

__all__ = ["common_folder", "write_bundle"]


def common_folder(paths: Iterable[Path]) -> Path:
    """Return the deepest folder that holds all paths.

    Raises
    ------
    InputError
        If there is none (other drives).
    """
    try:
        return Path(os.path.commonpath([path.resolve().parent for path in paths]))
    except ValueError as error:
        raise InputError(
            "the files of the sequence have no folder in common", "SETTING_WRONG"
        ) from error


def write_bundle(
    folder: Path,
    plans: Sequence[ShotPlan],
    *,
    root: Path,
    inputs: Iterable[Path],
    name: str,
    chunk: int,
) -> tuple[Path, ...]:
    """Write the bundle of a sequence: template, parameter values, asset references, list of shots.

    Parameters
    ----------
    folder : Path
    plans : sequence of ShotPlan
    root : Path
        The folder that holds the show; names in the list are relative to it.
    inputs : iterable of Path
        All files that the shots read.
    name : str
        Of the job.
    chunk : int
        Shots in a task.

    Returns
    -------
    tuple of Path
        The files, the template first.
    """
    outputs = sorted({str(plan.file.resolve().parent) for plan in plans})
    values: dict[str, str | int] = {
        "Root": str(root.resolve()),
        "Chunk": chunk,
        "Indices": f"0-{len(plans) - 1}",
    }
    template = _template(name[:LONGEST_NAME], len(plans), chunk)
    documents = bundle_documents(template, values, inputs, outputs)
    documents["shots"] = show_json(list(plans), root)
    return write_documents(folder, documents)


def _template(name: str, count: int, chunk: int) -> dict[str, Any]:
    """Return the template: a step that processes the shots, and one that gathers the table."""
    common = ["sequence", "{{Param.Shots}}", "--root", "{{Param.Root}}"]
    process = [*common, "--index", "{{Task.Param.Shot}}", "--workers", "1", "--keep-going"]
    gather = [*common, "--gather", "--table", "{{Param.Root}}/{{Param.Table}}"]
    shots = chunked("Shot")
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": name,
        "parameterDefinitions": [
            {
                "name": "Root",
                "type": "PATH",
                "objectType": "DIRECTORY",
                "dataFlow": "NONE",
                "description": "The folder that holds the show.",
            },
            {
                "name": "Shots",
                "type": "PATH",
                "objectType": "FILE",
                "dataFlow": "IN",
                "default": "shots.json",
                "description": "The list of shots; names in it are relative to Root.",
            },
            {
                "name": "Indices",
                "type": "STRING",
                "default": f"0-{count - 1}",
                "description": "Places of shots in the list, such as 0-9 or 3,7.",
            },
            {
                "name": "Chunk",
                "type": "INT",
                "minValue": 1,
                "default": chunk,
                "description": "Shots in a task.",
            },
            {
                "name": "Table",
                "type": "STRING",
                "default": "table.html",
                "description": "The table of all shots, in Root.",
            },
            USDFACE,
        ],
        "steps": [
            step("Process", [*process, "--progress", "openjd"], [shots]),
            step("Table", gather, after="Process"),
        ],
    }
