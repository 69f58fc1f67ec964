"""The record of a shot's making: as of a result, and the names and findings that it was made with.

Names count beside the content of files, since the shot refers to its files by them: another take
that the show file names is another shot, also where the old one did not change.

A shot that was edited, and kept although its files changed, has a record of that in ``kept.json``,
with the edited shot among its files: until either changes again there is nothing to do.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from usdface.findings import Finding, finding
from usdface.findings.codes import CODES
from usdface.io.relative_path import relative_path
from usdface.show.plan import Making, ShotPlan
from usdface.show.record import Record, read_record, record_path, write_record

__all__ = ["is_made", "is_settled", "making_findings", "note_kept", "note_making", "read_making"]


def read_making(shot: Path) -> Record | None:
    """Read the record of a shot's making; None where there is none."""
    return read_record(record_path(shot, "made"))


def note_making(
    plan: ShotPlan, making: Making, record: Record, findings: Iterable[Finding]
) -> None:
    """Write the record of a shot that was made, with the names of its files and the findings."""
    row = {**_named(plan, making), "findings": [found.code for found in findings]}
    write_record(record_path(plan.file, "made"), replace(record, row=row))


def note_kept(plan: ShotPlan, making: Making, record: Record) -> None:
    """Write the record of a shot that was kept; its own file is among those of the record."""
    write_record(record_path(plan.file, "kept"), replace(record, row=_named(plan, making)))


def is_settled(plan: ShotPlan) -> bool:
    """Return whether a shot needs not be made: it is as planned, or was kept for its edits."""
    if plan.making is None:
        return True
    records = (read_record(record_path(plan.file, name)) for name in ("made", "kept"))
    return any(is_made(record, plan.making, plan.file.parent) for record in records)


def is_made(record: Record | None, making: Making, folder: Path) -> bool:
    """Return whether a shot in a folder is made as planned: from these files, as they are now."""
    if record is None or record.key != record.key_now(folder, making.options):
        return False
    names, named = record.row.get("named"), making.named
    if not isinstance(names, dict) or names.keys() != named.keys():
        return False
    return all(_is_named(path, str(names[role]), folder) for role, path in named.items())


def making_findings(record: Record | None, name: str) -> list[Finding]:
    """Return the findings of making a shot of that name, without their messages."""
    codes = record.row.get("findings") if record is not None else None
    known = [code for code in codes if code in CODES] if isinstance(codes, list) else []
    return [finding(code, name) for code in known]


def _named(plan: ShotPlan, making: Making) -> dict[str, dict[str, str]]:
    folder = plan.file.parent
    return {"named": {role: relative_path(path, folder) for role, path in making.named.items()}}


def _is_named(path: Path, name: str, folder: Path) -> bool:
    """Return whether a name in a folder leads to the file, by whatever way."""
    if relative_path(path, folder) == name:
        return True
    with suppress(OSError, ValueError):
        return path.samefile(folder / name)
    return False
