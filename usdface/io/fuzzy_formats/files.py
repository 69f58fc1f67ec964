"""Fuzzy systems from and to files, by their suffix."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from pxr import Usd

from usdface.errors import InputError, OutputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.io.atomic import write_text
from usdface.io.fuzzy_formats.read_fcl import read_fcl
from usdface.io.fuzzy_formats.read_fis import read_fis
from usdface.io.fuzzy_formats.read_fll import read_fll
from usdface.io.fuzzy_formats.write_fcl import fcl_text
from usdface.io.fuzzy_formats.write_fis import fis_text
from usdface.io.fuzzy_formats.write_fll import fll_text
from usdface.io.usd.fuzzy import read_fuzzy, write_fuzzy
from usdface.io.usd.held_layers import hold_layers
from usdface.io.usd.ignored_attributes import ignored_attributes
from usdface.io.usd.save_layers import save_layers
from usdface.io.usd.stage import open_stage
from usdface.schemas import tokens, write_fallback_types

__all__ = ["read_fuzzy_file", "write_fuzzy_file"]

_Reader = Callable[[Path], tuple[ExpressionSystem, list[Finding]]]
_Writer = Callable[[ExpressionSystem, str], tuple[str, list[Finding]]]
_TEXTS: dict[str, tuple[_Reader, _Writer]] = {
    ".fis": (read_fis, fis_text),
    ".fcl": (read_fcl, fcl_text),
    ".fll": (read_fll, fll_text),
}
_USD = (".usda", ".usdc", ".usd")
_SUFFIXES = (*_TEXTS, *_USD)


def read_fuzzy_file(path: Path) -> tuple[ExpressionSystem, list[Finding]]:
    """Read the fuzzy system of a .fis, .fcl, .fll or USD file.

    Raises
    ------
    InputError
        If the suffix is another, or there is not exactly one system.
    """
    suffix = path.suffix.lower()
    if suffix in _TEXTS:
        return _TEXTS[suffix][0](path)
    if suffix not in _USD:
        raise InputError(f"{path}: expected one of {', '.join(_SUFFIXES)}, found {suffix!r}")
    stage = open_stage(path)
    found = [p.GetPath() for p in stage.Traverse() if p.GetTypeName() == tokens.FUZZY_SYSTEM]
    if len(found) != 1:
        names = ", ".join(map(str, found)) or "none"
        raise InputError(f"{path}: expected one {tokens.FUZZY_SYSTEM}, found {names}")
    unread = [
        replace(each, where=f"{path}: {each.where}")
        for each in ignored_attributes([stage.GetPrimAtPath(found[0])])
    ]
    return read_fuzzy(stage, str(found[0])), unread


def write_fuzzy_file(path: Path, system: ExpressionSystem) -> list[Finding]:
    """Write a fuzzy system as .fis, .fcl, .fll or USD; return findings on losses.

    Raises
    ------
    OutputError
        If the suffix is another, the format cannot hold the system, or the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix in _TEXTS:
        name = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
        text, findings = _TEXTS[suffix][1](system, name if name[:1].isalpha() else f"f_{name}")
        write_text(path, text)
        return findings
    if suffix not in _USD:
        raise OutputError(f"{path}: expected one of {', '.join(_SUFFIXES)}, found {suffix!r}")
    stage = Usd.Stage.CreateInMemory()
    hold_layers(stage)
    write_fallback_types(stage.GetRootLayer())
    write_fuzzy(stage, "/Fuzzy", system)
    stage.SetDefaultPrim(stage.GetPrimAtPath("/Fuzzy"))
    save_layers([(path, stage.GetRootLayer())], names_files=False)
    return []
