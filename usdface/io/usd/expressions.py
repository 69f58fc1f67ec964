"""Expression poses as USD prims (`docs/architecture.md`)."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, Vt

from usdface.errors import errors_at
from usdface.io.usd.attributes import author, strings_of, value_or
from usdface.schemas import tokens
from usdface.setup.expression import Expression

__all__ = ["read_expressions", "write_expressions"]

_NAMES = Sdf.ValueTypeNames


def write_expressions(stage: Usd.Stage, scope: str, expressions: Sequence[Expression]) -> list[str]:
    """Define a `UsdFaceExpression` under `scope` for each expression; return their paths."""
    stage.DefinePrim(scope, "Scope")
    paths = []
    for expression in expressions:
        prim = stage.DefinePrim(f"{scope}/{expression.name}", tokens.EXPRESSION)
        author(prim, tokens.SHAPES, _NAMES.TokenArray, Vt.TokenArray(expression.shapes))
        author(prim, tokens.WEIGHTS, _NAMES.FloatArray, Vt.FloatArray(expression.weights.tolist()))
        gain = prim.CreateAttribute(tokens.GAIN, _NAMES.Float, False)
        gain.Set(expression.gain)
        paths.append(str(prim.GetPath()))
    return paths


def read_expressions(prims: Sequence[Usd.Prim]) -> tuple[Expression, ...]:
    """Read `UsdFaceExpression` prims.

    Raises
    ------
    InputError
        If shapes and weights do not fit each other, or a weight lies outside [0, 1].
    """
    result = []
    for prim in prims:
        with errors_at(f"prim <{prim.GetPath()}>"):
            result.append(
                Expression(
                    prim.GetName(),
                    strings_of(prim, tokens.SHAPES),
                    np.array(value_or(prim, tokens.WEIGHTS, ()), dtype=np.float64),
                    float(value_or(prim, tokens.GAIN, 1.0)),
                )
            )
    return tuple(result)
