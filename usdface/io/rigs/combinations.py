"""Combination shapes of a folder: `combinations.json` beside the meshes.

::

    {"jawOpen_smile": ["jawOpen", "mouthSmile_L"],
     "mouthClose": {"of": ["jawOpen"], "rule": "limit"}}
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import get_args

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.json_values import checked_object
from usdface.rigs import Combination, CombinationRule, Rig

__all__ = ["combinations_file", "read_combinations"]

_NAME = "combinations.json"
_LARGEST = 4_000_000  # bytes: some 40,000 combinations


def combinations_file(folder: Path) -> Path:
    """Return the file that declares a folder's combinations, be it there or not."""
    return folder / _NAME


def read_combinations(folder: Path, rig: Rig) -> tuple[Rig, list[Finding]]:
    """Return the rig with the combinations that its folder declares.

    Raises
    ------
    InputError
        If the file cannot be read as such.
    """
    path = combinations_file(folder)
    if not path.is_file():
        return rig, []
    if path.stat().st_size > _LARGEST:
        raise InputError(
            f"{path} is larger than any list of combinations; "
            "give the file of the combinations alone",
            "TOO_LARGE",
        )
    try:
        document = json.loads(
            path.read_text(encoding="utf-8-sig"), object_pairs_hook=checked_object
        )
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no JSON that can be read: {error}; is it cut off, or in another format?",
            "FILE_UNREADABLE",
        ) from error
    if not isinstance(document, dict):
        raise InputError(
            f"{path}: expected an object with a list of shapes for each combination",
            "SCHEMA_BROKEN",
        )
    declared = {name: _combination(value, f"{path}: {name!r}") for name, value in document.items()}
    meshes = tuple(
        replace(
            mesh,
            shapes=tuple(
                replace(s, combination=declared.get(s.name, s.combination)) for s in mesh.shapes
            ),
        )
        for mesh in rig.meshes
    )
    unknown = [name for name in declared if name not in rig.shape_names]
    found = [finding("SHAPE_UNKNOWN", name, "it is named in {file}", path.name) for name in unknown]
    return replace(rig, meshes=meshes), found


def _combination(value: object, where: str) -> Combination:
    given = value if isinstance(value, dict) else {"of": value}
    of, rule = given.get("of"), given.get("rule", "product")
    good = isinstance(of, list) and of and all(isinstance(name, str) for name in of)
    if not good or rule not in get_args(CombinationRule) or set(given) - {"of", "rule"}:
        raise InputError(
            f"{where} is {value!r}; expected a list of blend shapes, or an object with such a list "
            f'as "of" and a "rule": {", ".join(get_args(CombinationRule))}',
            "SCHEMA_BROKEN",
        )
    return Combination(tuple(of), rule)  # type: ignore[arg-type]
