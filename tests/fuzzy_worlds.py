"""Random fuzzy systems for property tests, by hypothesis."""

from math import isfinite

from expression_systems import expression_system
from hypothesis import strategies as st

from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.fuzzy.norms import AGGREGATIONS, HEDGES, S_NORMS, T_NORMS
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Combined, Condition, Proposition, Rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.rule_text import condition_text

__all__ = ["systems"]

# Weights and gains are floats in USD and come back as their shortest decimal.
short = st.integers(0, 1000).map(lambda n: n / 1000)
number = st.floats(-1e6, 1e6, allow_subnormal=False).filter(isfinite)
positive = st.floats(1e-3, 1e3)


def rising(count: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.lists(number, min_size=count, max_size=count, unique=True).map(
        lambda numbers: tuple(sorted(numbers))
    )


PARAMETERS = {
    "triangular": rising(3),
    "trapezoidal": rising(4),
    "ramp": st.permutations([0, 1]).flatmap(
        lambda order: rising(2).map(lambda p: (p[order[0]], p[order[1]]))
    ),
    "gaussian": st.tuples(number, positive),
    "gaussian_pair": st.tuples(rising(2), positive, positive).map(
        lambda t: (t[0][0], t[1], t[0][1], t[2])
    ),
    "sigmoid": st.tuples(number, positive),
    "bell": st.tuples(number, positive, positive),
    "s_shape": rising(2),
    "z_shape": rising(2),
    "pi_shape": rising(4),
    # No heights of a triangle or trapezium, which come back from FCL as such.
    "points": st.tuples(rising(3), st.floats(0.1, 0.3), st.floats(0.4, 0.6)).map(
        lambda t: (t[0][0], t[1], t[0][1], t[2], t[0][2], 0.0)
    ),
}
FEATURE = st.builds(
    MarkerFeature,
    st.sampled_from(("lip", "left brow", "Ångström")),
    st.sampled_from(("x", "y", "z")),
    st.sampled_from(("absolute", "signed")),
)
WORDS = ("low", "middle", "high", "very", "rule", "ende", "t_1")


def terms(names: tuple[str, ...], plain: bool = False) -> st.SearchStrategy[tuple[Term, ...]]:
    kinds = st.sampled_from(sorted(PARAMETERS.keys() - ({"points"} if plain else set())))
    parameters = kinds.flatmap(lambda kind: st.tuples(st.just(kind), PARAMETERS[kind]))
    return st.lists(parameters, min_size=len(names), max_size=len(names)).map(
        lambda made: tuple(Term(n, k, p) for n, (k, p) in zip(names, made, strict=True))
    )


def bounds() -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(number, positive).map(lambda t: (t[0], t[0] + t[1]))


@st.composite
def inputs(draw: st.DrawFn, name: str, plain: bool = False) -> Variable:
    names = tuple(draw(st.lists(st.sampled_from(WORDS), min_size=1, max_size=3, unique=True)))
    return Variable(
        name,
        "input",
        draw(terms(names, plain)),
        draw(st.none() | bounds()),
    )


def conditions(variables: list[Variable], plain: bool) -> st.SearchStrategy[Condition]:
    """Return conditions; plain ones are those of MATLAB: each variable once, in order, only NOT."""
    hedges = st.sampled_from(("not",) if plain else sorted(HEDGES))

    def proposition(variable: Variable) -> st.SearchStrategy[Condition]:
        asked = st.lists(hedges, max_size=1 if plain else 2)
        named = st.sampled_from([t.name for t in variable.terms])
        return st.tuples(named, asked).map(lambda t: Proposition(variable.name, t[0], tuple(t[1])))

    if plain:
        order = list(variables)
        some = st.lists(st.sampled_from(order), min_size=1, unique=True).map(
            lambda chosen: sorted(chosen, key=order.index)
        )
        parts = some.flatmap(lambda v: st.tuples(*map(proposition, v)))
        how = st.sampled_from(("and", "or"))
        return st.tuples(how, parts).map(
            lambda t: t[1][0] if len(t[1]) == 1 else Combined(t[0], t[1])
        )
    one = st.sampled_from(variables).flatmap(proposition)

    def joined(part: st.SearchStrategy[Condition]) -> st.SearchStrategy[Condition]:
        several = st.lists(part, min_size=2, max_size=3).map(tuple)
        return st.builds(Combined, st.sampled_from(("and", "or")), several)

    return st.recursive(one, joined, max_leaves=5)


@st.composite
def systems(draw: st.DrawFn, plain: bool = False) -> ExpressionSystem:
    """Draw a system of up to three inputs, two outputs and four rules."""
    mamdani = draw(st.booleans())
    read = [draw(inputs(name, plain)) for name in ("lip_y", "b", "x_1")[: draw(st.integers(1, 3))]]
    named = []
    for name in ("joy", "wut")[: draw(st.integers(1, 2))]:
        low, high = draw(bounds())
        made = (Term("flat", "constant", (draw(number),)),)
        made += (Term("plane", "linear", tuple(draw(number) for _ in range(len(read) + 1))),)
        made = draw(terms(("little", "much"), plain)) if mamdani else made
        default = low + draw(short) * (high - low)
        default = min(max(default, low), high)
        named.append(Variable(name, "output", terms=made, range=(low, high), default=default))
    rules = [draw(rule(read, named, mamdani, plain)) for _ in range(draw(st.integers(0, 4)))]
    settings = {
        "normalisation": draw(st.sampled_from(("per_output", "all_rules", "weighted_sum"))),
        "else_rule": draw(st.booleans()),
        "and_": draw(st.sampled_from(sorted(T_NORMS))),
        "or_": draw(st.sampled_from(sorted(S_NORMS))),
        "gain": draw(short),
        "smoothing": draw(st.floats(0.0, 10.0)),
        "mode": draw(st.sampled_from(("raise", "add"))),
    }
    if mamdani:
        settings |= {
            "inference": "mamdani",
            "normalisation": "all_rules",  # it has none
            "implication": draw(st.sampled_from(sorted(T_NORMS))),
            "aggregation": draw(st.sampled_from(sorted(AGGREGATIONS))),
            "defuzzifier": draw(st.sampled_from(("centroid", "bisector", "mean_of_max"))),
            "samples": draw(st.integers(2, 120)),
            "sampling": draw(st.sampled_from(("ends", "middles"))),
        }
    return expression_system(
        (*read, *named), rules, draw(st.tuples(*[FEATURE] * len(read))), **settings
    )


@st.composite
def rule(
    draw: st.DrawFn, read: list[Variable], given: list[Variable], mamdani: bool, plain: bool
) -> Rule:
    condition = draw(conditions(read, plain))
    result = []
    for output in given[: draw(st.integers(1, len(given)))]:
        low, high = output.span
        value = draw(short.map(lambda share, lo=low, hi=high: lo + share * (hi - lo)))
        level = repr(min(max(value, low), high))
        term = draw(st.sampled_from([t.name for t in output.terms]))
        result.append(f"{output.name} IS {term if mamdani or draw(st.booleans()) else level}")
    text = f"IF {condition_text(condition)} THEN {' AND '.join(result)}"
    return parse_rule(text, draw(short), draw(st.booleans()))
