"""The command `formats`."""

import argparse
from dataclasses import replace
from typing import Any

from usdface import pipeline
from usdface.cli.command import add_command, report

__all__ = ["add_formats"]

_TITLES = {"takes": "take", "rigs": "rig", "exports": "export"}


def add_formats(commands: Any, summary: str) -> None:
    """Add `usdface formats`."""
    add_command(commands, "formats", _formats, summary)


def _formats(parsed: argparse.Namespace) -> int:
    result = pipeline.list_formats()
    if parsed.format == "text":
        rows = {
            f"{_TITLES[kind]}: {each['name']}": f"{' '.join(each['suffixes'])}  {each['origin']}"
            for kind, listed in result.details.items()
            for each in listed
        }
        result = replace(result, summary=rows)
    return report(parsed, result)
