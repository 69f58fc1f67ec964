"""Fuzzy systems with every kind of term, and the way into a file and back."""

from expression_systems import expression_system

from usdface.expression_system import MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file

__all__ = ["BROW", "FORMATS", "LIP", "READS", "SYSTEMS", "TERMS", "both_ways", "mamdani", "sugeno"]

TERMS = (
    Term("tri", "triangular", (-1, -0.5, 0.25)),
    Term("trap", "trapezoidal", (-0.5, 0, 0.25, 1)),
    Term("up", "ramp", (0.1, 1)),
    Term("down", "ramp", (0, -1)),
    Term("gauss", "gaussian", (0.3, 0.7)),
    Term("pair", "gaussian_pair", (-0.5, 0.3, 0.6, 0.8)),
    Term("sig", "sigmoid", (0.2, -4)),
    Term("bell", "bell", (0.1, 0.8, 1.5)),
    Term("s", "s_shape", (-1, 0.5)),
    Term("z", "z_shape", (-1, 0.5)),
    Term("pi", "pi_shape", (-1, 0, 0.5, 1)),
)
FORMATS = (".fis", ".fcl", ".fll", ".usda", ".usdc")
BROW = Variable("brow_y", "input", TERMS)
READS = (MarkerFeature("left brow", "z", "absolute"), MarkerFeature("lip", "x"))
LIP = Variable("lip_x", "input", TERMS[::-1], range=(-2, 2))


def sugeno(**settings):
    joy = Variable("joy", "output")
    plane = (Term("plane", "linear", (0.5, -1, 2)), Term("flat", "constant", (-0.25,)))
    out = Variable("out", "output", terms=plane, range=(-3, 5), default=0.5)
    rules = [f"IF brow_y IS {t.name} AND lip_x IS NOT {t.name} THEN joy IS 0.3" for t in TERMS]
    rules += ["IF brow_y IS up OR lip_x IS sig THEN joy IS 1 AND out IS plane"]
    rules += ["IF lip_x IS bell THEN out IS flat", "IF lip_x IS pi THEN out IS 1.125"]
    made = [parse_rule(rule, (20 - i) / 20, i != 3) for i, rule in enumerate(rules)]
    return expression_system((BROW, LIP, joy, out), made, READS, **settings)


def mamdani(**settings):
    terms = (Term("low", "triangular", (0, 1, 4)), Term("high", "pi_shape", (1, 3, 5, 6)))
    out = Variable("out", "output", terms=terms, range=(0, 6), default=2)
    rules = (
        parse_rule("IF brow_y IS tri AND lip_x IS gauss THEN out IS low"),
        parse_rule("IF lip_x IS NOT s THEN out IS high", 0.5),
    )
    return expression_system((BROW, LIP, out), rules, READS, inference="mamdani", **settings)


SYSTEMS = {
    "default": sugeno(),
    "others": sugeno(
        normalisation="per_output", and_="prod", or_="probor", else_rule=False, mode="add"
    ),
    "far": sugeno(normalisation="weighted_sum", and_="hamacher", or_="einstein", gain=0.7),
    "mamdani": mamdani(),
    "mamdani far": mamdani(
        implication="einstein",
        aggregation="sum",
        defuzzifier="mean_of_max",
        samples=57,
        sampling="middles",
        space="take",
        face_unit="none",
        response=(0.25, 0.5),
        smoothing=0.125,
        blend_time=0.375,
        ease=0.25,
        evidence=0.625,
        likeness=0.75,
    ),
}


def both_ways(tmp_path, system, suffix):
    path = tmp_path / f"system{suffix}"
    written = write_fuzzy_file(path, system)
    found, read = read_fuzzy_file(path)
    assert read == []
    return found, [f.code for f in written]
