"""Expression poses survive USD."""

import numpy as np
import pytest
from pxr import Sdf, Usd, Vt

from usdface.errors import InputError
from usdface.io.usd.expressions import read_expressions, write_expressions
from usdface.schemas import tokens
from usdface.setup.expression import Expression


def test_expressions_survive_usd() -> None:
    stage = Usd.Stage.CreateInMemory()
    expressions = (
        Expression("joy", ("smile L", "smile R"), np.array([0.5, 1.0]), gain=0.5),
        Expression("fear", (), np.zeros(0)),
    )
    paths = write_expressions(stage, "/Expressions", expressions)
    assert paths == ["/Expressions/joy", "/Expressions/fear"]
    back = read_expressions([stage.GetPrimAtPath(path) for path in paths])
    for one, other in zip(back, expressions, strict=True):
        assert (one.name, one.shapes, one.gain) == (other.name, other.shapes, other.gain)
        np.testing.assert_array_equal(one.weights, other.weights)


@pytest.mark.parametrize("weights", [[0.5], [0.5, 1.5], [0.5, float("nan")]])
def test_expression_weights_must_fit_and_lie_in_the_box(weights: list[float]) -> None:
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/joy", tokens.EXPRESSION)
    kinds = Sdf.ValueTypeNames
    prim.CreateAttribute(tokens.SHAPES, kinds.TokenArray).Set(Vt.TokenArray(["a", "b"]))
    prim.CreateAttribute(tokens.WEIGHTS, kinds.FloatArray).Set(Vt.FloatArray(weights))
    with pytest.raises(InputError, match="/joy"):
        read_expressions([prim])
