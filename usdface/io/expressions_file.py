"""Expression poses from a file: weights of blend shapes or action units by emotion.

As JSON: blend shapes of the rig, or action units of FACS (of one half: 12L, 14R), which suit any
rig whose shapes carry known names; null leaves one of the six basic emotions out::

    {"contempt": {"units": {"12L": 0.3, "14L": 0.8}, "gain": 0.8},
     "joy": {"shapes": {"mouthSmile_L": 0.9, "mouthSmile_R": 0.9}},
     "fear": null}

As USD: every `UsdFaceExpression` of the file.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.face.expression_poses import EMOTIONS, ActionPose
from usdface.face.facs_names import action_unit
from usdface.fuzzy.rule_parser import KEYWORDS
from usdface.io.json_values import checked_object
from usdface.io.takes.text_table import read_text
from usdface.io.usd.expressions import read_expressions
from usdface.io.usd.stage import open_stage
from usdface.schemas import tokens
from usdface.setup.expression import Expression

__all__ = ["expressions_json", "read_expressions_file"]

_LARGEST = 16_000_000  # bytes
_LARGEST_GAIN = 1e6  # set by hand; far beyond use, and within float32
_DIGITS = 6  # of a weight, as float32 holds
_USD = (".usda", ".usdc", ".usd")


def read_expressions_file(path: Path) -> dict[str, Expression | ActionPose | None]:
    """Read expression poses, by name.

    Raises
    ------
    InputError
        If the file is missing or not of a form above; the message names the expression.
    """
    if path.suffix.lower() in _USD:
        return _from_usd(path)
    if path.is_file() and path.stat().st_size > _LARGEST:
        raise InputError(f"{path} is larger than any file of expressions; expected a small one")
    try:
        document = json.loads(read_text(path), object_pairs_hook=checked_object)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is no JSON that can be read: {error}") from error
    if not isinstance(document, dict) or not document:
        raise InputError(f'{path}: expected an object, e.g. {{"joy": {{"shapes": {{...}}}}}}')
    return {name: _expression(path, name, value) for name, value in document.items()}


def _from_usd(path: Path) -> dict[str, Expression | ActionPose | None]:
    stage = open_stage(path)  # held, because prims expire with it
    prims = [prim for prim in stage.Traverse() if prim.GetTypeName() == tokens.EXPRESSION]
    if not prims:
        raise InputError(f"{path} has no {tokens.EXPRESSION}; author one for each expression")
    found: dict[str, Expression | ActionPose | None] = {}
    for expression in read_expressions(prims):
        if expression.name in found:
            raise InputError(f"{path} has two expressions {expression.name!r}; rename one")
        found[expression.name] = expression
    return found


def _expression(path: Path, name: str, value: object) -> Expression | ActionPose | None:
    where = f"{path}: expression {name!r}"
    if not name.isidentifier() or name.upper() in KEYWORDS:
        raise InputError(
            f"{where} must be called by one word of letters, digits and _, and none of "
            f"{', '.join(KEYWORDS)}"
        )
    if value is None:
        if name not in EMOTIONS:
            raise InputError(f"{where} is null, which leaves out one of {', '.join(EMOTIONS)}")
        return None
    if not isinstance(value, dict) or not set(value) <= {"shapes", "units", "gain"}:
        raise InputError(
            f'{where} is {value!r}; expected {{"shapes": {{name: weight}}, "gain": 1}} or "units"'
        )
    gain = _number(where, "gain", value.get("gain", 1.0))
    if ("shapes" in value) == ("units" in value):
        raise InputError(f'{where} has no "shapes" and no "units", or both; expected one of them')
    kind = "shapes" if "shapes" in value else "units"
    if not isinstance(value[kind], dict) or not value[kind]:
        raise InputError(f'{where} has no "{kind}"; expected an object of names and weights')
    pose = {key: _number(where, key, number) for key, number in value[kind].items()}
    try:
        if kind == "units":
            units = {action_unit(key): weight for key, weight in pose.items()}
            if len(units) < len(pose):
                raise InputError(f"an action unit occurs twice in {', '.join(pose)}; remove one")
            return ActionPose(name, units, gain)
        return Expression(name, tuple(pose), np.array(list(pose.values())), gain)
    except InputError as error:
        problem = str(error).removeprefix(f"expression {name!r}: ")
        raise InputError(f"{where}: {problem}") from error


def _number(where: str, key: str, number: object) -> float:
    if (
        isinstance(number, (int, float))
        and not isinstance(number, bool)
        and 0 <= number < _LARGEST_GAIN
    ):
        return float(number)
    raise InputError(f"{where}: {key} is {number!r}; expected a number, 0 or more")


def expressions_json(expressions: Sequence[Expression]) -> str:
    """Return expression poses as `read_expressions_file` reads them."""
    document = {
        e.name: {
            "shapes": {
                shape: round(float(weight), _DIGITS)
                for shape, weight in zip(e.shapes, e.weights, strict=True)
            },
            "gain": e.gain,
        }
        for e in expressions
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
