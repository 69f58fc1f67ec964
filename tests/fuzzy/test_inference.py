import itertools

import fuzzylite as fl
import numpy as np
import pytest

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate, rules_firing_at
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

TERMS = (
    Term("low", "triangular", (-1.0, -0.5, 0.25)),
    Term("medium", "trapezoidal", (-0.5, 0.0, 0.25, 1.0)),
    Term("high", "ramp", (0.0, 1.0)),
)
FL_TERMS = {"triangular": fl.Triangle, "trapezoidal": fl.Trapezoid, "ramp": fl.Ramp}
IDENTITY = Term("on", "ramp", (0.0, 1.0))


def identity_system(rules, inputs="ab", outputs=("anger", "joy"), **settings):
    """Inputs are firing strengths."""
    variables = [Variable(n, "input", terms=(IDENTITY,)) for n in inputs]
    variables += [Variable(n, "output") for n in outputs]
    return FuzzySystem(tuple(variables), tuple(rules), **settings)


def random_world(seed=0, rules=12):
    rng = np.random.default_rng(seed)
    inputs = [f"x{i}" for i in range(4)]
    outputs = ("joy", "fear")
    made = []
    for i in range(rules):
        chosen = rng.choice(4, size=rng.integers(1, 4), replace=False)
        conditions = [f"{inputs[c]} is {TERMS[rng.integers(3)].name}" for c in chosen]
        text = f"if {' and '.join(conditions)} then {outputs[i % 2]} is {rng.uniform():.3f}"
        made.append(parse_rule(text))
    variables = [Variable(n, "input", terms=TERMS) for n in inputs]
    return (*variables, *(Variable(n, "output") for n in outputs)), tuple(made)


def fuzzylite_outputs(system, inputs):
    names = {r.consequents[0] for r in system.rules}
    terms = {pair: f"t{i}" for i, pair in enumerate(sorted(names))}
    engine = fl.Engine(
        input_variables=[
            fl.InputVariable(
                v.name,
                minimum=-10,
                maximum=10,
                terms=[FL_TERMS[t.kind](t.name, *t.parameters) for t in v.terms],
            )
            for v in system.inputs
        ],
        output_variables=[
            fl.OutputVariable(
                name,
                minimum=0,
                maximum=1,
                default_value=0.0,
                aggregation=None,
                defuzzifier=fl.WeightedAverage("TakagiSugeno"),
                terms=[fl.Constant(t, z) for (o, z), t in terms.items() if o == name],
            )
            for name in system.output_names
        ],
        rule_blocks=[
            fl.RuleBlock(
                conjunction=fl.Minimum() if system.and_ == "min" else fl.AlgebraicProduct(),
                implication=None,
                activation=fl.General(),
                rules=[
                    fl.Rule.create(
                        f"{r.text.split(' then ')[0]} then "
                        f"{r.consequents[0][0]} is {terms[r.consequents[0]]} with {r.weight}"
                    )
                    for r in system.rules
                ],
            )
        ],
    )
    for rule in engine.rule_blocks[0].rules:
        rule.load(engine)
    return np.array([fuzzylite_frame(engine, frame) for frame in inputs])


def fuzzylite_frame(engine, frame):
    for variable, value in zip(engine.input_variables, frame, strict=True):
        variable.value = float(value)
    engine.process()
    return [float(variable.value) for variable in engine.output_variables]


@pytest.mark.parametrize(("and_", "seed"), [("min", 0), ("prod", 1), ("min", 2), ("prod", 3)])
def test_agrees_with_pyfuzzylite(and_, seed):
    variables, rules = random_world(seed)
    system = FuzzySystem(variables, rules, "per_output", and_, else_rule=False)
    inputs = np.random.default_rng(seed).uniform(-1.2, 1.2, (150, 4))
    expected = fuzzylite_outputs(system, inputs)
    ours = evaluate(system, inputs).outputs
    np.testing.assert_allclose(ours, expected, atol=1e-12)
    assert ours.std(axis=0).min() > 0.05


def test_the_papers_worked_example():
    rules = [parse_rule("IF a IS on THEN anger IS 1"), parse_rule("IF b IS on THEN anger IS 0.5")]
    for normalisation in ("per_output", "all_rules"):
        system = identity_system(rules, normalisation=normalisation, else_rule=False)
        answer = evaluate(system, np.array([[0.3, 0.2]]))
        assert answer.outputs[0, 0] == pytest.approx(0.8, abs=1e-15)
        np.testing.assert_array_equal(answer.firing, [[0.3, 0.2]])


@pytest.mark.parametrize(
    ("normalisation", "else_rule", "expected"),
    [
        ("per_output", False, [1.0, 0.5]),
        ("all_rules", False, [0.6, 0.2]),
        ("per_output", True, [0.6 / (0.6 + 0.4), 0.2 / (0.4 + 0.4)]),
        ("all_rules", True, [0.6 / 1.4, 0.2 / 1.4]),
    ],
)
def test_denominators(normalisation, else_rule, expected):
    rules = [parse_rule("IF a IS on THEN anger IS 1"), parse_rule("IF b IS on THEN joy IS 0.5")]
    system = identity_system(rules, normalisation=normalisation, else_rule=else_rule)
    np.testing.assert_allclose(evaluate(system, np.array([[0.6, 0.4]])).outputs[0], expected)


@pytest.mark.parametrize("else_rule", [True, False])
def test_nothing_fired_is_0(else_rule):
    system = identity_system([parse_rule("IF a IS on THEN joy IS 1")], else_rule=else_rule)
    assert not evaluate(system, np.zeros((3, 2))).outputs.any()
    assert not evaluate(identity_system([]), np.ones((3, 2))).outputs.any()


def test_with_an_else_rule_outputs_go_to_their_defaults_continuously():
    system = identity_system([parse_rule("IF a IS on THEN joy IS 1")], else_rule=True)
    strengths = np.linspace(0, 1, 101)
    outputs = evaluate(system, np.stack([strengths, strengths], axis=1)).outputs
    np.testing.assert_allclose(outputs[:, 1], strengths, atol=1e-15)


def test_an_occluded_marker_silences_only_its_rules():
    rules = [parse_rule("IF a IS on THEN joy IS 1"), parse_rule("IF b IS on THEN anger IS 1")]
    answer = evaluate(identity_system(rules, else_rule=True), np.array([[np.nan, 0.5]]))
    np.testing.assert_array_equal(answer.firing, [[0, 0.5]])
    np.testing.assert_array_equal(answer.outputs, [[0.5, 0]])


def test_weight_scales_and_disabled_rules_are_silent():
    on = "IF a IS on THEN joy IS 1"
    inputs = np.array([[0.8, 0.0]])
    half = identity_system([parse_rule(on, 0.5)])
    assert evaluate(half, inputs).firing[0, 0] == 0.4
    off = identity_system([parse_rule(on, enabled=False)])
    assert not evaluate(off, inputs).firing.any()


@pytest.mark.parametrize(
    ("normalisation", "and_", "else_rule"),
    list(itertools.product(["per_output", "all_rules"], ["min", "prod"], [True, False])),
)
def test_frame_by_frame_and_all_at_once_are_bit_equal(normalisation, and_, else_rule):
    variables, rules = random_world(5, 16)
    system = FuzzySystem(variables, rules, normalisation, and_, else_rule=else_rule)
    inputs = np.random.default_rng(5).uniform(-1.2, 1.2, (201, 4))
    inputs[::7, 1] = np.nan
    whole = evaluate(system, inputs)
    single = [evaluate(system, inputs[f : f + 1]) for f in range(len(inputs))]
    np.testing.assert_array_equal(whole.outputs, np.concatenate([s.outputs for s in single]))
    np.testing.assert_array_equal(whole.firing, np.concatenate([s.firing for s in single]))
    assert whole.outputs.min() >= 0 and whole.outputs.max() <= 1


@pytest.mark.parametrize("normalisation", ["per_output", "all_rules", "weighted_sum"])
def test_blocks_of_frames_do_not_show(monkeypatch, normalisation):
    variables, rules = random_world(7)
    negated = parse_rule("IF NOT (x0 IS high AND x1 IS high) THEN joy IS 0.3", 0.5)
    off = parse_rule("IF x2 IS low THEN fear IS 1", enabled=False)
    system = FuzzySystem(variables, (*rules, negated, off), normalisation)
    inputs = np.random.default_rng(7).uniform(-1.2, 1.2, (120, 4))
    inputs[50:60, :2] = np.nan
    whole = evaluate(system, inputs)
    monkeypatch.setattr("usdface.fuzzy.inference._BLOCK", 37)
    parts = evaluate(system, inputs)
    np.testing.assert_array_equal(parts.outputs, whole.outputs)
    np.testing.assert_array_equal(parts.firing, whole.firing)
    assert not whole.firing[:, -1].any() and whole.firing[:, -2].any()


def test_the_order_of_rules_does_not_matter():
    variables, rules = random_world(6)
    inputs = np.random.default_rng(6).uniform(-1.2, 1.2, (50, 4))
    outputs = [evaluate(FuzzySystem(variables, r), inputs).outputs for r in (rules, rules[::-1])]
    np.testing.assert_allclose(*outputs, atol=1e-14)


def test_wrong_number_of_inputs_is_refused():
    with pytest.raises(InputError, match=r"expected \(frames, 2\)"):
        evaluate(identity_system([]), np.zeros((5, 3)))


def test_rules_that_fire_at_a_point_are_named():
    near = Variable("c", "input", terms=(Term("still", "triangular", (-1, 0, 1)),))
    rules = (
        parse_rule("IF c IS still THEN joy IS 1"),
        parse_rule("IF c IS still AND a IS on THEN joy IS 1"),
        parse_rule("IF a IS on THEN joy IS 0.5"),
        parse_rule("IF c IS still THEN joy IS 0.1", enabled=False),
    )
    variables = (Variable("a", "input", terms=(IDENTITY,)), near, Variable("joy", "output"))
    system = FuzzySystem(variables, rules)
    assert rules_firing_at(system, np.zeros(2)) == [rules[0]]
    assert rules_firing_at(system, np.array([0.5, 0.5])) == list(rules[:3])
    assert rules_firing_at(system, np.array([-1.0, 2.0])) == []


def tipper(**settings):
    """MATLAB's example: service and food from 0 to 10, tip from 0 to 30 per cent."""
    service = [Term(n, "gaussian", (m, 1.5)) for n, m in (("poor", 0), ("good", 5), ("best", 10))]
    food = [
        Term("rancid", "trapezoidal", (0, 0, 1, 3)),
        Term("delicious", "trapezoidal", (7, 9, 10, 10)),
    ]
    tip = [Term(n, "triangular", (m - 5, m, m + 5)) for n, m in (("cheap", 5), ("average", 15))]
    tip.append(Term("generous", "triangular", (20, 25, 30)))
    variables = (
        Variable("service", "input", terms=tuple(service), range=(0, 10)),
        Variable("food", "input", terms=tuple(food), range=(0, 10)),
        Variable("tip", "output", terms=tuple(tip), range=(0, 30), default=15),
    )
    rules = (
        "IF service IS poor OR food IS rancid THEN tip IS cheap",
        "IF service IS good THEN tip IS average",
        "IF service IS best OR food IS delicious THEN tip IS generous",
    )
    settings = {"inference": "mamdani", "else_rule": False} | settings
    return FuzzySystem(variables, tuple(map(parse_rule, rules)), **settings)


def test_matlabs_documented_tips():
    """Fuzzy Logic Toolbox, pages of `evalfis` and "Build Mamdani Systems"."""
    inputs = np.array([[2, 1], [4, 5], [7, 8], [1, 2], [3, 5], [2, 7], [3, 1]], dtype=float)
    documented = [7.0169, 14.4585, 20.3414, 5.5586, 12.2184, 7.7885, 8.9547]
    np.testing.assert_allclose(evaluate(tipper(), inputs).outputs[:, 0], documented, atol=5.1e-5)


def test_a_mamdani_systems_else_rule_says_the_default_as_far_as_nothing_fires():
    system = tipper(else_rule=True)
    inputs = np.array([[2.0, 5.0], [np.nan, np.nan]])
    free, faded = evaluate(tipper(), inputs), evaluate(system, inputs)
    strongest = free.firing.max(axis=1)
    np.testing.assert_allclose(
        faded.outputs[:, 0], strongest * free.outputs[:, 0] + (1 - strongest) * 15
    )
    assert faded.outputs[1, 0] == free.outputs[1, 0] == 15


def test_or_parentheses_not_and_hedges():
    rules = [
        "IF (a IS on OR b IS on) AND b IS not on THEN joy IS 1",
        "IF a IS on OR b IS on AND b IS not on THEN joy IS 1",
        "IF NOT (a IS on AND b IS on) THEN joy IS 1",
        "IF a IS not very on THEN joy IS 1",
        "IF NOT a IS somewhat on THEN joy IS 1",
    ]
    system = identity_system([parse_rule(rule) for rule in rules], or_="probor")
    a, b = 0.5, 0.25
    firing = evaluate(system, np.array([[a, b]])).firing[0]
    expected = [min(a + b - a * b, 1 - b), a + b - a * b, 1 - b, 1 - a * a, 1 - np.sqrt(a)]
    np.testing.assert_allclose(firing, expected, atol=1e-15)


def test_not_does_not_make_a_rule_of_an_occluded_marker_fire():
    rules = ["IF a IS not on THEN joy IS 1", "IF NOT (a IS on OR b IS on) THEN joy IS 1"]
    system = identity_system([parse_rule(rule) for rule in rules])
    assert not evaluate(system, np.array([[np.nan, 0.0]])).firing.any()


def test_a_negation_is_as_true_as_it_is_whatever_the_occluded_marker_does():
    rules = [
        "IF NOT (a IS on AND b IS on) THEN joy IS 1",
        "IF NOT (a IS on OR b IS on) THEN joy IS 1",
        "IF NOT (NOT a IS on AND b IS on) THEN joy IS 1",
        "IF NOT MOST OF (a IS on, b IS on) THEN joy IS 1",
    ]
    system = identity_system([parse_rule(rule) for rule in rules])
    hidden = evaluate(system, np.array([[np.nan, 0.25]])).firing[0]
    of_any = evaluate(system, np.array([[a, 0.25] for a in np.linspace(0, 1, 11)])).firing
    np.testing.assert_allclose(hidden, of_any.min(axis=0), atol=1e-15)
    assert hidden[0] == 0.75 and hidden[1] == 0.0


@pytest.mark.parametrize(
    ("normalisation", "expected"),
    [("per_output", (0.6 * 6 + 0.2 * 3) / 0.8), ("weighted_sum", 0.6 * 6 + 0.2 * 3)],
)
def test_order_one_sugeno(normalisation, expected):
    terms = (Term("plane", "linear", (5, 10, 1)), Term("flat", "constant", (3,)))
    out = Variable("out", "output", terms=terms, range=(-10, 10), default=-2)
    inputs = [Variable(n, "input", terms=(IDENTITY,)) for n in "ab"]
    rules = tuple(map(parse_rule, ("IF a IS on THEN out IS plane", "IF b IS on THEN out IS flat")))
    system = FuzzySystem((*inputs, out), rules, normalisation, else_rule=False)
    answers = evaluate(system, np.array([[0.6, 0.2], [0, 0]])).outputs[:, 0]
    np.testing.assert_allclose(answers, [expected, -2])


@pytest.mark.parametrize("kind", ["gaussian", "gaussian_pair", "sigmoid", "bell", "pi_shape"])
def test_smooth_terms_are_bit_equal_frame_by_frame(kind, monkeypatch):
    monkeypatch.setattr("usdface.fuzzy.inference._BLOCK", 4096)
    parameters = {
        "gaussian": (0, 1),
        "gaussian_pair": (-1, 0.5, 0, 1),
        "sigmoid": (0, 3),
        "bell": (0.1, 1, 1.7),
        "pi_shape": (-2, -1, 0, 1),
    }[kind]
    variable = Variable("a", "input", terms=(Term("on", kind, parameters),))
    rule = parse_rule("IF a IS seldom on THEN joy IS 1")
    system = FuzzySystem((variable, Variable("joy", "output")), (rule,))
    inputs = np.random.default_rng(3).normal(size=(5003, 1))
    whole = evaluate(system, inputs).outputs
    single = [evaluate(system, inputs[f : f + 1]).outputs for f in range(0, 5003, 37)]
    np.testing.assert_array_equal(whole[::37], np.concatenate(single))


@pytest.mark.parametrize("inference", ["sugeno", "mamdani"])
def test_a_system_without_outputs_has_no_outputs(inference):
    variables = (Variable("a", "input", terms=(IDENTITY,)),)
    for else_rule in (False, True):
        system = FuzzySystem(variables, (), inference=inference, else_rule=else_rule)
        assert evaluate(system, np.zeros((3, 1))).outputs.shape == (3, 0)
