import numpy as np
import pytest

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.io.fuzzy_formats.read_fis import read_fis

# The tipping example of the Fuzzy Logic Toolbox, by the figures of its documentation.
TIPPER = """% a comment
[System]
Name='tipper'
Type='mamdani'
Version=2.0
NumInputs=2
NumOutputs=1
NumRules=3
AndMethod='min'
OrMethod='max'
ImpMethod='min'
AggMethod='max'
DefuzzMethod='centroid'

[Input1]
Name='service'
Range=[0 10]
NumMFs=3
MF1='poor':'gaussmf',[1.5 0]
MF2='good':'gaussmf',[1.5 5]
MF3='excellent':'gaussmf',[1.5 10]

[Input2]
Name='food'
Range=[0 10]
NumMFs=2
MF1='rancid':'trapmf',[0 0 1 3]
MF2='delicious':'trapmf',[7 9 10 10]

[Output1]
Name='tip'
Range=[0 30]
NumMFs=3
MF1='cheap':'trimf',[0 5 10]
MF2='average':'trimf',[10 15 20]
MF3='generous':'trimf',[20 25 30]

[Rules]
1 1, 1 (1) : 2
2 0, 2 (1) : 1
3 2, 3 (1) : 2
"""


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "tip.fis"
        path.write_text(text)
        return path

    return write


def test_matlabs_documented_tips(file):
    """Fuzzy Logic Toolbox, pages of `evalfis` and "Build Mamdani Systems"."""
    system, findings = read_fis(file(TIPPER))
    inputs = np.array([[2, 1], [4, 5], [7, 8], [1, 2], [3, 5], [2, 7], [3, 1]], dtype=float)
    documented = [7.0169, 14.4585, 20.3414, 5.5586, 12.2184, 7.7885, 8.9547]
    np.testing.assert_allclose(
        evaluate(system.fuzzy, inputs).outputs[:, 0], documented, atol=5.1e-5
    )
    assert {f.code for f in findings} == {"ROLE_ASSUMED", "UNITS_ASSUMED"}


def test_where_nothing_fires_it_is_the_middle_of_the_range_as_in_matlab(file):
    system, _ = read_fis(file(TIPPER))
    assert evaluate(system.fuzzy, np.array([[np.nan, np.nan]])).outputs[0, 0] == 15


def test_parameters_are_put_in_our_order(file):
    text = TIPPER.replace("'gaussmf',[1.5 0]", "'gbellmf',[2 4 6]")
    text = text.replace("'gaussmf',[1.5 5]", "'sigmf',[-3 5]")
    text = text.replace("'gaussmf',[1.5 10]", "'gauss2mf',[1 2 3 4]")
    terms = read_fis(file(text))[0].fuzzy.inputs[0].terms
    assert [(t.kind, t.parameters) for t in terms] == [
        ("bell", (6, 2, 4)),
        ("sigmoid", (5, -3)),
        ("gaussian_pair", (2, 1, 4, 3)),
    ]


def test_names_with_blanks_are_changed_and_said(file):
    system, findings = read_fis(file(TIPPER.replace("'service'", "'the service'")))
    assert system.fuzzy.inputs[0].name == "the_service"
    assert [f.code for f in findings if "ASSUMED" not in f.code] == ["NAME_CHANGED"]


def test_negative_indices_say_not(file):
    system, _ = read_fis(file(TIPPER.replace("2 0, 2", "-2 1, 2")))
    assert (
        system.fuzzy.rules[1].text
        == "IF service IS NOT good AND food IS rancid THEN tip IS average"
    )


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("1 1, 1 (1) : 2", "1 7, 1 (1) : 2", "line 39: rule .* food has no term 7; it has 2"),
        ("1 1, 1 (1) : 2", "1 nan, 1 (1) : 2", "line 39: .* no term nan"),
        ("1 1, 1 (1) : 2", "1 1.5, 1 (1) : 2", "line 39: .* hedge of 1.5 has no counterpart"),
        ("1 1, 1 (1) : 2", "1, 1 (1) : 2", "line 39: expected 2 numbers"),
        ("1 1, 1 (1) : 2", "1 1, -1 (1) : 2", "line 39: .* conclusion with NOT"),
        ("1 1, 1 (1) : 2", "0 0, 1 (1) : 2", "line 39: .* no condition"),
        ("1 1, 1 (1) : 2", "1 1, 1 (3) : 2", "line 39: .* weight is 3"),
        ("1 1, 1 (1) : 2", "one rule", "line 39: expected indices"),
        ("'gaussmf',[1.5 0]", "'dsigmf',[1 2 3 4]", "line 19: the term 'dsigmf' .* no counterpart"),
        ("'gaussmf',[1.5 0]", "'gaussmf',[1.5]", "line 19: gaussmf has 1 parameters; expected 2"),
        (
            "'gaussmf',[1.5 0]",
            "'gaussmf',[0 0]",
            "line 19: .* deviation is 0; expected a number above 0",
        ),
        ("'gaussmf',[1.5 0]", "gaussmf 1.5 0", "line 19: expected 'name':'kind',"),
        ("AndMethod='min'", "AndMethod='myand'", "line 9: AndMethod 'myand' has no counterpart"),
        ("Type='mamdani'", "Type='type2'", "line 4: Type 'type2' has no counterpart"),
        ("NumMFs=3", "NumMFs=4", "line 18: NumMFs is 4, but there are 3"),
        ("NumRules=3", "NumRules=999999999", "line 8: NumRules is 999999999"),
        ("[Input2]", "[Input3]", r"2 Input sections but no \[Input2\]"),
        ("[Input2]", "[Input1]", r"line 23: a second \[Input1\]"),
        ("Range=[0 30]", "Range=[30 0]", "line 32: .* range"),
        ("[System]", "[Other]", "no .System. section"),
    ],
)
def test_what_has_no_counterpart_is_named_with_its_line(file, old, new, says):
    with pytest.raises(InputError, match=says) as error:
        read_fis(file(TIPPER.replace(old, new, 1)))
    assert str(error.value).startswith("tip.fis") and "\n" not in str(error.value)


# In the manner of Octave's fuzzy-logic-toolkit: its comments, norms, and hedges in hundredths.
OCTAVE = """## a comment
[System]
Name = 'Risk'
Type = 'sugeno'
NumInputs = 2
NumOutputs = 1
NumRules = 3
AndMethod = 'einstein_product'
OrMethod = 'algebraic_sum'
ImpMethod = 'einstein_product'
AggMethod = 'einstein_sum'
DefuzzMethod = 'wtaver'

[Input1]
Name = 'a'
Range = [0 1]
NumMFs = 1
MF1 = 'on' : 'trimf', [0 1 2]

[Input2]
Name = 'b'
Range = [0 1]
NumMFs = 1
MF1 = 'on' : 'trimf', [0 1 2]

[Output1]
Name = 'risk'
Range = [0 10]
NumMFs = 2
MF1 = 'low' : 'constant', [1]
MF2 = 'high' : 'constant', [9]

[Rules]
1.20 -1.05, 1 (1) : 1
1.40 0, 2 (1) : 1
1.00 1.00, 2.00 (0.50) : 2
"""


def test_octaves_norms_and_hedges(file):
    system, _ = read_fis(file(OCTAVE))
    a, b = 0.8, 0.25
    x, y = a * a, 1 - np.sqrt(b)
    fired = [x * y / (2 - (x + y - x * y)), a**4, 0.5 * (a + b - a * b)]
    found = evaluate(system.fuzzy, np.array([[a, b]]))
    np.testing.assert_allclose(found.firing[0], fired, atol=1e-15)
    np.testing.assert_allclose(found.outputs[0, 0], np.dot(fired, [1, 9, 9]) / sum(fired))


def test_a_hedge_that_has_no_counterpart_is_named(file):
    with pytest.raises(InputError, match=r"line 35: .* hedge of 1.3 .* expected .05"):
        read_fis(file(OCTAVE.replace("1.40 0,", "1.30 0,")))
    with pytest.raises(InputError, match=r"line 35: .* conclusion with VERY .* term of its own"):
        read_fis(file(OCTAVE.replace("1.40 0, 2", "1.40 0, 2.2")))


def test_files_of_matlabs_first_version_fill_up_with_zeros_and_count_as_they_like(file):
    old = TIPPER.replace("'trimf',[0 5 10]", "'trimf',[0 5 10 0]")
    old = old.replace("'gaussmf',[1.5 5]", "'gaussmf',[1.5 5 0 0]").replace("MF3='exc", "MF2='exc")
    assert old.count("0]") > TIPPER.count("0]")
    assert read_fis(file(old))[0] == read_fis(file(TIPPER))[0]
    with pytest.raises(InputError, match="line 19: gaussmf has 3 parameters; expected 2"):
        read_fis(file(TIPPER.replace("[1.5 0]", "[1.5 0 1]")))


def test_what_matlab_answers_in_another_way_is_said(file):
    def messages(text):
        return [f.message for f in read_fis(file(text))[1] if f.code == "MEANING_DIFFERS"]

    smallest = TIPPER.replace("'centroid'", "'som'")
    assert messages(TIPPER) == messages(smallest) == messages(OCTAVE) == []
    (message,) = messages(smallest.replace("Range=[0 30]", "Range=[-1 30]"))
    assert "their distance to 0" in message
    (message,) = messages(OCTAVE.replace("'constant', [9]", "'linear', [1 2 3]"))
    assert "the outputs of risk are clipped to its range, 0 to 10" in message
    (message,) = messages(OCTAVE.replace("'constant', [9]", "'constant', [11]"))
    assert "clipped to its range" in message


def test_a_crowd_of_terms_or_inputs_is_refused_before_they_are_named(file):
    terms = "MF1='poor':'gaussmf',[1.5 0]\n"
    crowd = TIPPER.replace(terms, terms * 20_000)
    with pytest.raises(InputError, match="20002 terms of one variable; expected at most 1000"):
        read_fis(file(crowd))
    inputs = "".join(f"[Input{i}]\nName='x'\nNumMFs=0\n" for i in range(3, 20_000))
    with pytest.raises(InputError, match="19999 variables; expected at most 1000"):
        read_fis(
            file(TIPPER.replace("NumInputs=2\n", "").replace("[Output1]", inputs + "[Output1]"))
        )


@pytest.mark.parametrize("index", ["1e308", "-1e308", "1e999", "nan", "99999999999999999999"])
def test_an_index_of_any_size_is_refused_in_one_line(file, index):
    with pytest.raises(InputError, match="line"):
        read_fis(file(TIPPER.replace("2 0, 2", f"{index} 0, 2")))


def test_a_file_without_variables_is_no_fuzzy_system(tmp_path):
    (tmp_path / "cut.fis").write_text("[System]\nName='cut'\n")
    with pytest.raises(InputError, match=r"cut.fis has no variables"):
        read_fis(tmp_path / "cut.fis")
