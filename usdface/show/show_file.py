"""The show file, TOML (or the same as JSON): the shots of a sequence and their characters.

::

    folder = "shots"                  # where shots are made; beside the show file if left out
    files = ["old/*.usda"]            # shots that are there already

    [process]                         # options of `usdface process`, of each shot
    gltf = true
    exaggeration = {brows = 1.2}

    [characters.mia]
    rig = "mia.usdc"
    bind = {anna = "anna_on_mia.json"}  # by performer, or one file

    layer = "mia_setup.usda"          # a layer that all its shots sublayer; made if it is missing

    [performers.anna]
    calibration = "anna.json"
    layer = "anna.usda"

    [[shots]]
    name = "sq010_0010"
    take = "takes/010.usdc"
    performer = "anna"
    character = "mia"                 # or characters = ["mia", "tom"]: a shot of each

A key of a shot goes before that of its performer, which goes before that of its character. Names of
files are relative to the show file.
"""

import json
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

from usdface.errors import InputError, did_you_mean, errors_at
from usdface.options import CorrectionOptions, DeliverOptions, ProcessOptions
from usdface.show.plan import FILES, LAYERS, Making, ShotPlan, check_shared_layers
from usdface.show.show_values import (
    as_list,
    as_switch,
    as_table,
    as_text,
    check_keys,
    check_number,
)

__all__ = ["read_show_file", "show_document"]

_LARGEST = 64_000_000  # bytes
_CORRECTION = tuple(part.name for part in fields(CorrectionOptions))
_SETUP = (*FILES, *LAYERS, "neutral", *_CORRECTION)
_BY_OTHER = ("bind", "calibration", "layer")  # of a performer by character, or the other way
_TOP = ("folder", "files", "process", "characters", "performers", "shots")
_SHOT = (*_SETUP, "name", "file", "performer", "character", "characters", "process")
_BESIDE = ("gltf", "page", "deliver", "skip_hooks")  # of [process], not of `ProcessOptions`
_PROCESS = (
    *(part.name for part in fields(ProcessOptions) if part.name != "trace"),
    *_BESIDE,
)


def read_show_file(path: Path, root: Path | None = None) -> list[ShotPlan]:
    """Read a show file.

    Parameters
    ----------
    path : Path
        .toml or .json.
    root : Path, optional
        The folder that names of files are relative to, in place of that of `path`.

    Raises
    ------
    InputError
        If it cannot be read, or names an unknown key, character or performer.
    """
    document = show_document(path)
    check_keys(document, _TOP, str(path))
    base = root or path.parent
    folder = base / as_text(document.get("folder", "."), f"{path}: folder")
    common = as_table(document.get("process", {}), f"{path}: process")
    plans = [
        _present(file, common, f"{path}: process")
        for pattern in as_list(document.get("files", []), f"{path}: files")
        for file in _matching(base, as_text(pattern, f"{path}: files"), str(path))
    ]
    for number, entry in enumerate(as_list(document.get("shots", []), f"{path}: shots")):
        where = f"{path}: shot {number + 1}"
        if isinstance(as_table(entry, where).get("name"), str):
            where += f" ({entry['name']:.80})"
        check_keys(entry, _SHOT, where)
        plans += _shots(entry, document, common, base, folder, where)
    (name, count), *_ = Counter(plan.name for plan in plans).most_common(1) or [("", 0)]
    if count > 1:
        raise InputError(f"{path}: two shots are named {name!r}", "NAME_REPEATED")
    check_shared_layers(plans, path)
    return plans


def show_document(path: Path) -> dict[str, Any]:
    """Return the contents of a show file, .json or .toml, unchecked.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f"{path} is larger than any show file", "TOO_LARGE")
        text = path.read_text(encoding="utf-8-sig")
        document = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise InputError(
            f"cannot read the show file {path}: {error.strerror}", "FILE_UNREADABLE"
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"the show file {path} cannot be read: {error}", "FILE_UNREADABLE"
        ) from error
    return as_table(document, str(path))


def _shots(
    entry: dict[str, Any],
    document: dict[str, Any],
    common: dict[str, Any],
    base: Path,
    folder: Path,
    where: str,
) -> Iterator[ShotPlan]:
    """Yield the shots of one entry: one for each of its characters."""
    characters = entry.get("characters", [entry.get("character", "")])
    performer = as_text(entry.get("performer", ""), f"{where}: performer")
    for character in as_list(characters, f"{where}: characters"):
        name = _name(entry, where) + (f"_{character}" if "characters" in entry else "")
        process = {**common, **as_table(entry.get("process", {}), f"{where}: process")}
        file = entry.get("file")
        place = base / as_text(file, f"{where}: file") if file else folder / f"{name}.usda"
        setup = {
            **_of(document, "characters", as_text(character, where), performer, where),
            **_of(document, "performers", performer, character, where),
            **{key: value for key, value in entry.items() if key in _SETUP},
        }
        making = _making(setup, performer, base, where) if not file or "take" in setup else None
        yield _plan(name, place, making, process, where)


def _of(document: dict[str, Any], kind: str, name: str, other: str, where: str) -> dict[str, Any]:
    """Return the table of a character or a performer, with entries by the `other` for that.

    A binding, a performer's file and its layer are of one performer on one character.
    """
    tables = as_table(document.get(kind, {}), f"{kind}")
    if not name:
        return {}
    if name not in tables:
        near = did_you_mean(name, tables) or f"; add a table [{kind}.{name}], which may be empty"
        raise InputError(f"{where}: there is no {kind[:-1]} {name!r}{near}", "SETTING_WRONG")
    table = dict(as_table(tables[name], f"{kind}.{name}"))
    check_keys(table, (*_SETUP, "layer"), f"{where}: {kind}.{name}")
    for key in _BY_OTHER:
        if not isinstance(each := table.get(key), dict):
            continue
        table.pop(key)
        if other in each:
            table[key] = each[other]
        elif near := did_you_mean(other, set(each) - set(_others(document, kind))):
            raise InputError(
                f"{where}: {kind}.{name}: no {key} for {other!r}{near}", "SETTING_WRONG"
            )
    if "layer" in table:
        table[f"{kind[:-1]}_layer"] = table.pop("layer")
    return table


def _others(document: dict[str, Any], kind: str) -> dict[str, Any]:
    """Return the performers, of characters, and the characters, of performers."""
    other = "performers" if kind == "characters" else "characters"
    return as_table(document.get(other, {}), other)


def _making(setup: dict[str, Any], performer: str, base: Path, where: str) -> Making:
    for needed in ("rig", "take"):
        if needed not in setup:
            raise InputError(f"{where} has no {needed}", "SHOT_INCOMPLETE")
    files = {
        name: base / as_text(setup[name], f"{where}: {name}")
        for name in (*FILES, *LAYERS)
        if name in setup
    }
    neutral = setup.get("neutral")
    if isinstance(neutral, list):
        whole = all(type(frame) is int and frame >= 0 for frame in neutral)
        if not whole or len(neutral) != 2:
            raise InputError(
                f'{where}: neutral is {neutral}; expected [first, last] frame index, or "auto"',
                "SETTING_WRONG",
            )
        neutral = tuple(neutral)
    elif neutral not in (None, "auto"):
        raise InputError(
            f'{where}: neutral is {neutral!r}; expected [first, last] frame index, or "auto"',
            "SETTING_WRONG",
        )
    correction = {name: setup[name] for name in _CORRECTION if name in setup}
    _check_correction(correction, where)
    return Making(**files, neutral=neutral, correction=correction, performer=performer)


def _present(file: Path, process: dict[str, Any], where: str) -> ShotPlan:
    return _plan(file.stem, file, None, process, where)


def _plan(
    name: str, file: Path, making: Making | None, process: dict[str, Any], where: str
) -> ShotPlan:
    check_keys(process, _PROCESS, f"{where}: process")
    options = {key: value for key, value in process.items() if key not in _BESIDE}
    _check_options(options, where)
    skipped = as_list(process.get("skip_hooks", []), f"{where}: skip_hooks")
    return ShotPlan(
        name=name,
        file=file,
        making=making,
        process=options,
        gltf=as_switch(process.get("gltf", False), f"{where}: gltf"),
        page=as_switch(process.get("page", False), f"{where}: page"),
        deliver=_delivery(process.get("deliver", False), f"{where}: deliver"),
        skip_hooks=tuple(as_text(hook, f"{where}: skip_hooks") for hook in skipped),
    )


def _check_correction(correction: dict[str, Any], where: str) -> None:
    """Fail before the work where `CorrectionOptions` would not take the settings."""
    for name, value in correction.items():
        if name != "mode":
            check_number(value, f"{where}: {name}")
    with errors_at(where):
        CorrectionOptions(**correction)


def _check_options(options: dict[str, Any], where: str) -> None:
    """Fail before the work where `ProcessOptions` would not take the options."""
    for name in ("exaggeration", "gains"):
        for which, factor in as_table(options.get(name, {}), f"{where}: {name}").items():
            check_number(factor, f"{where}: {name} of {which}")
    for part in fields(ProcessOptions):
        if part.type is bool and part.name in options:
            as_switch(options[part.name], f"{where}: {part.name}")
    try:
        ProcessOptions(**options)
    except (InputError, AttributeError, TypeError) as error:
        raise InputError(f"{where}: process: {error}", "SETTING_WRONG") from error


def _delivery(value: object, where: str) -> dict[str, Any] | None:
    """Return the fields of `DeliverOptions`; None where nothing is to be delivered."""
    if isinstance(value, bool):
        return {} if value else None
    table = as_table(value, where)
    check_keys(table, tuple(part.name for part in fields(DeliverOptions)), where)
    for key, number in table.items():
        good = type(number) is int or (key == "rate" and isinstance(number, float))
        if not good:
            raise InputError(f"{where}: {key} is {number!r}; expected a number", "SETTING_WRONG")
    with errors_at(where):
        DeliverOptions(**table)
    return table


def _name(entry: dict[str, Any], where: str) -> str:
    """Return the name of a shot, which is that of its file in the folder of the show."""
    stem = Path(str(entry.get("file", entry.get("take", "")))).stem
    name = as_text(entry.get("name", stem), f"{where}: name")
    if not name or name.startswith((".", "/")) or ".." in Path(name).parts or "\\" in name:
        raise InputError(f"{where}: {name!r} cannot be the name of a shot", "SETTING_WRONG")
    return name


def _matching(base: Path, pattern: str, where: str) -> list[Path]:
    """Return the files of a pattern: all but results."""
    try:
        found = sorted(base.glob(pattern))
    except (NotImplementedError, ValueError) as error:
        raise InputError(f"{where}: {pattern!r}: {error}", "SETTING_WRONG") from error
    if not found:
        raise InputError(f"{where}: no file matches {pattern!r}", "FILE_UNREADABLE")
    return [file for file in found if file.is_file() and not file.stem.endswith(".usdface")]
