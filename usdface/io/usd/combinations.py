"""Combination shapes on a stage, which UsdSkel lacks, as two attributes of a BlendShape.

::

    def BlendShape "jawOpen_smile"
    {
        uniform token[] usdface:combination:of = ["jawOpen", "mouthSmileLeft"]
        uniform token usdface:combination:rule = "product"
    }

`of` names blend shapes by their tokens; `rule` is `product` (also if it is not authored), `min` or
`limit`. UsdSkel itself knows nothing of it: whoever animates authors the weight.
"""

from typing import get_args

from pxr import Sdf, Usd, Vt

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import value_or
from usdface.rigs import Combination, CombinationRule

__all__ = ["read_combination", "write_combination"]

_OF = "usdface:combination:of"
_RULE = "usdface:combination:rule"


def read_combination(prim: Usd.Prim) -> tuple[Combination | None, list[Finding]]:
    """Return the combination of a BlendShape prim; None where it is none."""
    of = value_or(prim, _OF, None)
    if not of:
        return None, []
    rule = str(prim.GetAttribute(_RULE).Get() if prim.HasAttribute(_RULE) else "product")
    for known in get_args(CombinationRule):
        if rule == known:
            return Combination(tuple(str(name) for name in of), known), []
    message = "its rule is {rule!r}; expected {expected}"
    return None, [
        finding(
            "COMBINATION_IGNORED", str(prim.GetPath()), message, rule, get_args(CombinationRule)
        )
    ]


def write_combination(prim: Usd.Prim, combination: Combination | None) -> None:
    """Author the combination of a BlendShape prim."""
    if combination is None:
        return
    names, uniform = Sdf.ValueTypeNames, Sdf.VariabilityUniform
    of = prim.CreateAttribute(_OF, names.TokenArray, custom=True, variability=uniform)
    of.Set(Vt.TokenArray(combination.of))
    prim.CreateAttribute(_RULE, names.Token, custom=True, variability=uniform).Set(combination.rule)
