"""Parts of Open Job Description bundles: a job that any manager with OpenJD runs.

Templates follow ``jobtemplate-2023-09`` with the extension TASK_CHUNKING; the values of their
parameters and the references to assets are as in the job bundles of AWS Deadline Cloud.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from usdface.io.atomic import all_or_none, write_text

__all__ = ["LONGEST_NAME", "USDFACE", "bundle_documents", "chunked", "step", "write_documents"]

LONGEST_NAME = 128  # characters, by the specification

USDFACE = {
    "name": "Usdface",
    "type": "STRING",
    "default": "usdface",
    "description": "The program.",
}


def chunked(name: str) -> dict[str, Any]:
    """Return the parameter of a step whose tasks are chunks of ``Indices``, ``Chunk`` at a time."""
    return {
        "name": name,
        "type": "CHUNK[INT]",
        "range": "{{Param.Indices}}",
        "chunks": {"defaultTaskCount": "{{Param.Chunk}}", "rangeConstraint": "CONTIGUOUS"},
    }


def step(
    name: str,
    arguments: Sequence[str],
    parameters: Sequence[Mapping[str, Any]] = (),
    *,
    after: str = "",
) -> dict[str, Any]:
    """Return a step that runs usdface with some arguments, after another step if there is one."""
    action = {"command": "{{Param.Usdface}}", "args": list(arguments)}
    made: dict[str, Any] = {"name": name}
    if parameters:
        made["parameterSpace"] = {"taskParameterDefinitions": list(parameters)}
    made["script"] = {"actions": {"onRun": action}}
    return made | ({"dependencies": [{"dependsOn": after}]} if after else {})


def bundle_documents(
    template: Mapping[str, Any],
    values: Mapping[str, str | int],
    inputs: Iterable[Path],
    outputs: Iterable[str],
) -> dict[str, str]:
    """Return template, parameter values and asset references as JSON, by the names of the files."""
    documents = {
        "template": template,
        "parameter_values": {
            "parameterValues": [{"name": key, "value": value} for key, value in values.items()]
        },
        "asset_references": {
            "assetReferences": {
                "inputs": {
                    "filenames": sorted({str(path.resolve()) for path in inputs}),
                    "directories": [],
                },
                "outputs": {"directories": list(outputs)},
                "referencedPaths": [],
            }
        },
    }
    return {
        name: json.dumps(document, indent=1, ensure_ascii=False) + "\n"
        for name, document in documents.items()
    }


def write_documents(folder: Path, documents: Mapping[str, str]) -> tuple[Path, ...]:
    """Write the files of a bundle, all or none; return them."""
    places = {name: folder / f"{name}.json" for name in documents}
    with all_or_none():
        for name, text in documents.items():
            write_text(places[name], text)
    return tuple(places.values())
