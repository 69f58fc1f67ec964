"""A sequence as an Open Job Description bundle: a job that any manager with OpenJD runs.

The template follows ``jobtemplate-2023-09`` with the extension TASK_CHUNKING; the values of its
parameters and the references to assets are as in the job bundles of AWS Deadline Cloud. A task is a
place in the list of shots, since lists of texts end at 1,024 entries and only integers come in
chunks.
"""

import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.io.atomic import all_or_none, write_text
from usdface.show.plan import ShotPlan
from usdface.show.show_file import show_json

__all__ = ["common_folder", "write_bundle"]

_LONGEST_NAME = 128  # characters, by the specification


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
    places = {name: folder / f"{name}.json" for name in _NAMES}
    outputs = sorted({str(plan.file.resolve().parent) for plan in plans})
    values = {"Root": str(root.resolve()), "Chunk": chunk, "Indices": f"0-{len(plans) - 1}"}
    documents = {
        "template": _template(name[:_LONGEST_NAME], len(plans), chunk),
        "parameter_values": {
            "parameterValues": [{"name": key, "value": value} for key, value in values.items()]
        },
        "asset_references": {
            "assetReferences": {
                "inputs": {
                    "filenames": sorted({str(path.resolve()) for path in inputs}),
                    "directories": [],
                },
                "outputs": {"directories": outputs},
                "referencedPaths": [],
            }
        },
    }
    with all_or_none():
        for key, document in documents.items():
            write_text(places[key], json.dumps(document, indent=1, ensure_ascii=False) + "\n")
        write_text(places["shots"], show_json(list(plans), root))
    return tuple(places.values())


_NAMES = ("template", "parameter_values", "asset_references", "shots")


def _template(name: str, count: int, chunk: int) -> dict[str, Any]:
    """Return the template: a step that processes the shots, and one that gathers the table."""
    common = ["sequence", "{{Param.Shots}}", "--root", "{{Param.Root}}"]
    process = [*common, "--index", "{{Task.Param.Shot}}", "--workers", "1", "--keep-going"]
    gather = [*common, "--gather", "--table", "{{Param.Root}}/{{Param.Table}}"]
    shots = {
        "name": "Shot",
        "type": "CHUNK[INT]",
        "range": "{{Param.Indices}}",
        "chunks": {"defaultTaskCount": "{{Param.Chunk}}", "rangeConstraint": "CONTIGUOUS"},
    }
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
            {
                "name": "Usdface",
                "type": "STRING",
                "default": "usdface",
                "description": "The program.",
            },
        ],
        "steps": [
            _step("Process", [*process, "--progress", "openjd"], [shots]),
            _step("Table", gather, []) | {"dependencies": [{"dependsOn": "Process"}]},
        ],
    }


def _step(name: str, arguments: list[str], parameters: list[dict[str, Any]]) -> dict[str, Any]:
    space = {"parameterSpace": {"taskParameterDefinitions": parameters}} if parameters else {}
    action = {"command": "{{Param.Usdface}}", "args": arguments}
    return {"name": name, **space, "script": {"actions": {"onRun": action}}}
