import numpy as np
import pytest

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.io.fuzzy_formats.read_fcl import read_fcl
from usdface.io.fuzzy_formats.write_fcl import fcl_text

# In the manner of the examples of IEC 61131-7, annex C: one output, singletons, a comment.
FAN = """FUNCTION_BLOCK Fan (* a comment
over two lines *)
VAR_INPUT
    temp : REAL;
    pressure : REAL; // outside
END_VAR
VAR_OUTPUT
    valve : REAL;
END_VAR
FUZZIFY temp
    TERM cold := (3, 1) (27, 0);
    TERM hot := (3, 0) (27, 1);
END_FUZZIFY
FUZZIFY pressure
    TERM low := (55, 1) (95, 0);
    TERM high := (55, 0) (95, 1);
END_FUZZIFY
DEFUZZIFY valve
    TERM drainage := -100;
    TERM closed := 0;
    TERM inlet := 100;
    ACCU : MAX;
    METHOD : COGS;
    DEFAULT := 0;
END_DEFUZZIFY
RULEBLOCK No1
    AND : MIN;
    RULE 1 : IF temp IS cold AND pressure IS low THEN valve IS inlet;
    RULE 2 : IF temp IS cold AND pressure IS high THEN valve IS closed WITH 0.8;
    RULE 3 : IF temp IS hot AND pressure IS low THEN valve IS closed;
    RULE 4 : IF NOT temp IS cold AND NOT (pressure IS low) THEN valve IS drainage;
END_RULEBLOCK
END_FUNCTION_BLOCK
"""


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "fan.fcl"
        path.write_text(text)
        return path

    return write


def test_singletons_by_hand(file):
    system, _ = read_fcl(file(FAN))
    cold, low = 1 / 4, 3 / 4  # 21 degrees, 65 of pressure
    fired = [min(cold, low), 0.8 * min(cold, 1 - low), min(1 - cold, low), min(1 - cold, 1 - low)]
    found = evaluate(system.fuzzy, np.array([[21.0, 65.0]]))
    np.testing.assert_allclose(found.firing[0], fired)
    expected = np.dot(fired, [100, 0, 0, -100]) / sum(fired)
    np.testing.assert_allclose(found.outputs[0, 0], expected, atol=1e-12)
    assert system.fuzzy.or_ == "max"


def differences(findings):
    return [each.message for each in findings if each.code == "MEANING_DIFFERS"]


def test_rules_of_one_singleton_add_up_and_that_other_programs_join_them_is_said(file):
    _, findings = read_fcl(file(FAN))  # jFuzzyLogic takes the larger of the rules 2 and 3
    (message,) = differences(findings)
    assert message.startswith("several rules conclude with the same value of valve")
    assert not differences(read_fcl(file(FAN.replace("ACCU : MAX", "ACCU : SUM")))[1])
    alone = FAN.replace(
        "    RULE 3 : IF temp IS hot AND pressure IS low THEN valve IS closed;\n", ""
    )
    assert not differences(read_fcl(file(alone))[1])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (":= 100;", ":= Linear 2 3 1;"),
        ("    ACCU", "    RANGE := (-10 .. 10);\n    ACCU"),
    ],
)
def test_conclusions_that_leave_the_range_are_said_to_be_clipped(file, old, new):
    system, findings = read_fcl(file(FAN.replace("ACCU : MAX", "ACCU : SUM").replace(old, new)))
    low, high = system.fuzzy.outputs[0].span
    assert differences(findings) == [
        f"the outputs of valve are clipped to its range, {low:g} to {high:g}"
    ]
    _, written = fcl_text(system, "fan")
    assert any("clipped" in message for message in differences(written))


def test_a_mamdani_block_and_points(file):
    text = FAN.replace("METHOD : COGS", "METHOD : COG").replace(
        "    ACCU", "    RANGE := (0..10);\n    ACCU"
    )
    text = text.replace(":= -100;", ":= (0, 0) (1, 1) (2, 0);").replace(":= 100;", ":= gauss 5 1;")
    system, _ = read_fcl(
        file(text.replace(":= 0;\n    TERM", ":= (2, 0) (3, 1) (4, 1) (5, 0);\n    TERM"))
    )
    assert [(t.kind, t.parameters) for t in system.fuzzy.outputs[0].terms] == [
        ("triangular", (0, 1, 2)),
        ("trapezoidal", (2, 3, 4, 5)),
        ("gaussian", (5, 1)),
    ]
    assert (system.fuzzy.inference, system.fuzzy.defuzzifier) == ("mamdani", "centroid")
    assert system.fuzzy.outputs[0].range == (0, 10)


def test_either_norm_stands_for_both(file):
    assert read_fcl(file(FAN.replace("AND : MIN", "OR : ASUM")))[0].fuzzy.and_ == "prod"
    assert read_fcl(file(FAN.replace("AND : MIN", "AND : BDIF")))[0].fuzzy.or_ == "lukasiewicz"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(27, 0);\n", "(27, 1.5);\n", "line 11: term 'cold': .* expected heights of points"),
        (
            "(27, 0);\n",
            "(5, 0.5) (4, 0);\n",
            "line 11: .* expected points with ascending x",
        ),
        ("(3, 1) (27, 0)", "(3 1) (27, 0)", "line 11: expected points"),
        ("(3, 1) (27, 0)", "(3, @) (27, 0)", "line 11: '@\\)' is no FCL"),
        (
            "TERM inlet := 100",
            "TERM inlet := lots 3",
            "line 21: the TERM 'lots' has no counterpart",
        ),
        ("METHOD : COGS", "METHOD : BEST", "line 23: the METHOD 'BEST' has no counterpart"),
        ("AND : MIN", "AND : MINE", "line 27: the AND 'MINE' has no counterpart"),
        ("FUZZIFY temp", "FUZZIFY heat", "line 10: FUZZIFY heat: there is no input of that name"),
        ("FUZZIFY temp", "FUZZIFY;", "line 10: FUZZIFY names no input"),
        ("IF temp IS cold AND", "IF temp cold AND", "line 28: rule .*column 9: expected IS"),
        ("IF temp IS cold AND", "IF temp IS warm AND", "rule .* temp has no term 'warm'"),
        ("valve IS inlet", "valve IS shut", "rule .* valve has no term 'shut'"),
        ("WITH 0.8", "WITH often", "line 29: expected a number, found 'often'"),
        ("END_FUNCTION_BLOCK", "END_FUNCTION_BLOCK\nFUNCTION_BLOCK b", "line 34: a second FUNC"),
        ("temp : REAL", "temp : STRING", "line 4: expected 'name : REAL;'"),
        ("END_RULEBLOCK\nEND_FUNCTION_BLOCK\n", "", "ends inside RULEBLOCK; the file is cut off"),
        ("END_FUNCTION_BLOCK\n", "IF temp", "line 33: 'IF' has no end; the file is cut off"),
    ],
)
def test_what_has_no_counterpart_is_named_with_its_line(file, old, new, says):
    text = FAN.replace(old, new, 1)
    assert text != FAN
    with pytest.raises(InputError, match=says) as error:
        read_fcl(file(text))
    assert str(error.value).startswith("fan.fcl") and "\n" not in str(error.value)


def test_fuzzylites_blocks_without_names_and_rules_without_semicolons(file):
    bare = FAN.replace("FUNCTION_BLOCK Fan", "FUNCTION_BLOCK", 1).replace("BLOCK No1", "BLOCK")
    rules = bare.index("RULE 1")
    bare = bare[:rules] + bare[rules:].replace(";", "")
    assert read_fcl(file(bare))[0] == read_fcl(file(FAN))[0]
    without = FAN.replace("    AND : MIN;\n", "").replace("BLOCK No1", "BLOCK")
    assert read_fcl(file(without))[0] == read_fcl(file(FAN))[0]


def test_comments_of_every_kind(file):
    text = FAN.replace("FUZZIFY temp", "/* as in C,\n * over lines */ FUZZIFY temp // and so on")
    assert read_fcl(file(text))[0] == read_fcl(file(FAN))[0]
    with pytest.raises(InputError, match="line 11: a comment has no end; the file is cut off"):
        read_fcl(file(FAN.replace("TERM cold", "/* TERM cold", 1)))


@pytest.mark.parametrize(
    ("old", "new", "field", "expected"),
    [
        ("AND : MIN", "AND : DMIN", "and_", "drastic"),
        ("AND : MIN", "AND : NIPMIN", "or_", "nilpotent"),
        ("AND : MIN", "AND : HAMACHER", "and_", "hamacher"),
        ("AND : MIN", "OR : EINSTEIN", "and_", "einstein"),
        ("AND : MIN", "OR : DMAX", "or_", "drastic"),
        ("ACCU : MAX", "ACCU : PROBOR", "aggregation", "probor"),
    ],
)
def test_jfuzzylogics_norms(file, old, new, field, expected):
    assert getattr(read_fcl(file(FAN.replace(old, new)))[0].fuzzy, field) == expected


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ("(3, 1) (5, 1) (7, 1) (27, 0)", ("ramp", (27, 7))),
        ("(3, 0) (5, 0) (27, 1)", ("ramp", (5, 27))),
        ("(3, 0) (5, 1) (7, 1) (9, 1) (27, 0) (30, 0)", ("trapezoidal", (3, 5, 9, 27))),
        ("(3, 1) (27, 1)", ("trapezoidal", (-np.inf, 3, 27, np.inf))),
        ("(3, 1) (9, 0.4) (12, 0.4) (27, 0)", ("points", (3, 1, 9, 0.4, 12, 0.4, 27, 0))),
        ("(3, 0) (9, 0.4) (12, 0.4) (15, 0.4)", ("points", (3, 0, 9, 0.4))),
    ],
)
def test_points_that_say_nothing_are_left_out(file, points, expected):
    system, _ = read_fcl(file(FAN.replace("(3, 1) (27, 0)", points)))
    (cold,) = (t for t in system.fuzzy.inputs[0].terms if t.name == "cold")
    assert (cold.kind, cold.parameters) == expected


def test_an_output_without_a_range_reaches_as_far_as_its_points_and_its_default(file):
    text = FAN.replace("METHOD : COGS", "METHOD : COG").replace("DEFAULT := 0", "DEFAULT := -9")
    for value, points in (("-100", "(0, 1) (5, 1) (10, 0)"), ("0", "(8, 0) (9, 1) (10, 0)")):
        text = text.replace(f":= {value};\n    TERM", f":= {points};\n    TERM", 1)
    text = text.replace(":= 100;", ":= (10, 0) (15, 1) (22, 1);")
    system, findings = read_fcl(file(text))
    assert system.fuzzy.outputs[0].range == (-9, 22)
    (message,) = differences(findings)
    assert message.startswith("valve has no range; with its default it is -9 to 22")
    system, findings = read_fcl(file(text.replace("-9", "3")))
    assert system.fuzzy.outputs[0].range == (0, 22)
    assert not differences(findings)


def test_a_function_of_the_inputs_has_no_counterpart(file):
    text = FAN.replace(":= 100;", ":= FUNCTION (temp * 0.8) + 1;")
    with pytest.raises(InputError, match="line 21: the TERM 'FUNCTION' has no counterpart"):
        read_fcl(file(text))
