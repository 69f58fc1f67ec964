import fuzzylite as fl
import numpy as np
import pytest
from expression_systems import expression_system

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.read_fll import read_fll
from usdface.io.fuzzy_formats.write_fll import fll_text

TERMS = (
    Term("tri", "triangular", (-1, -0.5, 0.25)),
    Term("trap", "trapezoidal", (-0.5, 0, 0.25, 1)),
    Term("up", "ramp", (0, 1)),
    Term("gauss", "gaussian", (0.3, 0.7)),
    Term("pair", "gaussian_pair", (-0.5, 0.3, 0.6, 0.8)),
    Term("sig", "sigmoid", (0.2, -4)),
    Term("bell", "bell", (0.1, 0.8, 1.5)),
    Term("s", "s_shape", (-1, 0.5)),
    Term("z", "z_shape", (-1, 0.5)),
    Term("pi", "pi_shape", (-1, 0, 0.5, 1)),
    Term("list", "points", (-1, 0.2, -0.25, 0.9, 0.5, 0, 1, 0.6)),
)
INPUTS = tuple(Variable(f"x{i}", "input", terms=TERMS, range=(-2, 2)) for i in range(3))
HEDGES = ("", "", "NOT ", "VERY ", "SOMEWHAT ", "EXTREMELY ", "SELDOM ", "NOT VERY ")
NORMS = [
    ("min", "max"),
    ("prod", "probor"),
    ("lukasiewicz", "lukasiewicz"),
    ("hamacher", "hamacher"),
    ("einstein", "einstein"),
    ("drastic", "drastic"),
    ("nilpotent", "nilpotent"),
]


def conditions(count, seed):
    rng = np.random.default_rng(seed)

    def one():
        return f"x{rng.integers(3)} IS {rng.choice(HEDGES)}{rng.choice(TERMS).name}"

    shapes = ("{} AND {}", "{} OR {}", "({} OR {}) AND {}", "{} OR {} AND {}", "{}")
    return [
        shape.format(*(one() for _ in range(shape.count("{}"))))
        for shape in (shapes[i % len(shapes)] for i in range(count))
    ]


def sugeno(and_, or_, **settings):
    terms = (Term("plane", "linear", (0.5, -1, 0.25, 1)), Term("flat", "constant", (-0.5,)))
    out = Variable("out", "output", terms=terms, range=(-9, 9), default=0.125)
    result = ("plane", "0.75", "flat", "-3")
    rules = tuple(
        parse_rule(f"IF {condition} THEN out IS {result[i % 4]}", (20 - i) / 20)
        for i, condition in enumerate(conditions(15, 1))
    )
    plain = {"normalisation": "per_output", "else_rule": False, "face_unit": "none"}
    return expression_system((*INPUTS, out), rules, and_=and_, or_=or_, **(plain | settings))


def mamdani(**settings):
    terms = (Term("low", "triangular", (0, 1, 4)), Term("high", "pi_shape", (1, 3, 5, 6)))
    out = Variable("out", "output", terms=terms, range=(0, 6), default=2)
    rules = tuple(
        parse_rule(f"IF {condition} THEN out IS {('low', 'high')[i % 2]}")
        for i, condition in enumerate(conditions(8, 2))
    )
    plain = {"else_rule": False, "face_unit": "none", "sampling": "middles", "samples": 100}
    return expression_system((*INPUTS, out), rules, inference="mamdani", **(plain | settings))


def judged(text, inputs):
    engine = fl.FllImporter().from_string(text)
    answers = []
    for frame in inputs:
        for variable, value in zip(engine.input_variables, frame, strict=True):
            variable.value = float(value)
        engine.process()
        answers.append([float(variable.value) for variable in engine.output_variables])
    return np.array(answers), engine


@pytest.fixture(autouse=True)
def exact(monkeypatch):
    """Let pyfuzzylite count rules that fire by less than its 1e-6, too."""
    monkeypatch.setattr(fl.lib, "abs_tolerance", 0.0)


@pytest.fixture
def judge(tmp_path):
    """Compare ours, pyfuzzylite's on our file, and ours on the file that it exports."""

    def compare(system, tolerance=1e-12):
        inputs = np.random.default_rng(0).uniform(-1.5, 1.5, (50, 3))
        text, findings = fll_text(system, "judged")
        assert findings == []
        expected, engine = judged(text, inputs)
        ours = evaluate(system.fuzzy, inputs).outputs
        np.testing.assert_allclose(ours, expected, atol=tolerance)
        assert ours.std() > 0.04
        path = tmp_path / "theirs.fll"
        path.write_text(fl.FllExporter().to_string(engine))
        back, _ = read_fll(path)
        # It exports three decimals, which all of these numbers have.
        np.testing.assert_allclose(evaluate(back.fuzzy, inputs).outputs, expected, atol=tolerance)

    return compare


@pytest.mark.parametrize(("and_", "or_"), NORMS)
def test_pyfuzzylite_reads_our_sugeno_systems_and_answers_the_same(judge, and_, or_):
    judge(sugeno(and_, or_))


def test_the_weighted_sum_too(judge):
    judge(sugeno("min", "max", normalisation="weighted_sum"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("defuzzifier", "implication", "aggregation"),
    [
        ("centroid", "min", "max"),
        ("centroid", "prod", "probor"),
        ("centroid", "einstein", "sum"),
        ("smallest_of_max", "min", "max"),
    ],
)
def test_and_our_mamdani_systems(judge, defuzzifier, implication, aggregation):
    judge(mamdani(defuzzifier=defuzzifier, implication=implication, aggregation=aggregation), 1e-9)


@pytest.mark.slow
def test_a_bisector_halves_the_area_as_pyfuzzylites_does_up_to_its_steps(tmp_path):
    system = mamdani(defuzzifier="bisector", samples=500)
    inputs = np.random.default_rng(0).uniform(-1.5, 1.5, (20, 3))
    expected, _ = judged(fll_text(system, "judged")[0], inputs)
    np.testing.assert_allclose(evaluate(system.fuzzy, inputs).outputs, expected, atol=0.01)


GOOD = fll_text(sugeno("min", "max"), "good")[0]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Triangle", "Spike", "the term 'Spike' has no counterpart; expected one of Triangle"),
        ("tri Triangle -1.0 -0.5 0.25", "tri Triangle a", "expected 1 number, found 'a'"),
        ("tri Triangle -1.0 -0.5 0.25", "tri", "expected a name, a kind"),
        ("tri Triangle -1.0 -0.5 0.25", "tri Triangle -1 -0.5 0.25 0.5", "expected 3 parameters"),
        ("range: -2.0 2.0", "range: 2", "expected 2 numbers"),
        ("activation: General", "activation: First 1 0", "the activation 'First 1 0' has no count"),
        ("conjunction: Minimum", "conjunction: Mine", "the conjunction 'Mine' has no counterpart"),
        ("if x", "when x", "rule .*line 1, column 1: expected IF, found when"),
        ("TakagiSugeno", "Tsukamoto", "Tsukamoto' has no counterpart"),
        ("InputVariable: x1", "InputVariable: x0", "'x0' is there already"),
        ("  activation: General", "  activation", "expected 'key: value'"),
        ("  activation: General", "  colour: red", "a rule block has no 'colour'"),
    ],
)
def test_what_has_no_counterpart_is_named_with_its_line(tmp_path, old, new, says):
    path = tmp_path / "a.fll"
    path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=says) as error:
        read_fll(path)
    assert str(error.value).startswith("a.fll, line ") and "\n" not in str(error.value)


@pytest.mark.parametrize("samples", ["inf", "nan", "12.5", "1e9", "-4"])
def test_samples_are_a_whole_number_that_fits(tmp_path, samples):
    path = tmp_path / "a.fll"
    path.write_text(fll_text(mamdani(), "a")[0].replace("Centroid 100", f"Centroid {samples}"))
    with pytest.raises(InputError, match="samples; expected"):
        read_fll(path)


def test_what_is_left_out_is_said(tmp_path):
    path = tmp_path / "a.fll"
    text = GOOD.replace("lock-previous: false", "lock-previous: true")
    path.write_text(text.replace("default: 0.125", "default: nan"))
    system, findings = read_fll(path)
    assert [f.code for f in findings] == ["MEANING_DIFFERS"] * 2
    assert system.fuzzy.outputs[0].default == 0


def test_a_height_of_1_is_none(tmp_path):
    path = tmp_path / "a.fll"
    path.write_text(GOOD.replace("Triangle -1.0 -0.5 0.25", "Triangle -1 -0.5 0.25 1.0"))
    assert read_fll(path)[0] == sugeno("min", "max")


def test_an_aggregation_of_a_sugeno_output_is_said_to_differ_between_versions_of_fuzzylite(
    tmp_path,
):
    text, _ = fll_text(sugeno("min", "max"), "judged")
    path = tmp_path / "judged.fll"
    path.write_text(text)
    assert not [each for each in read_fll(path)[1] if "same value" in each.message]
    path.write_text(text.replace("aggregation: none", "aggregation: Maximum"))
    (found,) = [each for each in read_fll(path)[1] if "same value" in each.message]
    assert (found.code, found.where) == ("MEANING_DIFFERS", "judged.fll: out")
