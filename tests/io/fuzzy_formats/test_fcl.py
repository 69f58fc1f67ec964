import numpy as np
import pytest

from usdface.errors import InputError
from usdface.fuzzy.inference import evaluate
from usdface.io.fuzzy_formats.fcl import read_fcl

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
    found = evaluate(system, np.array([[21.0, 65.0]]))
    np.testing.assert_allclose(found.firing[0], fired)
    expected = np.dot(fired, [100, 0, 0, -100]) / sum(fired)
    np.testing.assert_allclose(found.outputs[0, 0], expected, atol=1e-12)
    assert system.or_ == "max"


def test_a_mamdani_block_and_points(file):
    text = FAN.replace("METHOD : COGS", "METHOD : COG").replace(
        "    ACCU", "    RANGE := (0..10);\n    ACCU"
    )
    text = text.replace(":= -100;", ":= (0, 0) (1, 1) (2, 0);").replace(":= 100;", ":= gauss 5 1;")
    system, _ = read_fcl(
        file(text.replace(":= 0;\n    TERM", ":= (2, 0) (3, 1) (4, 1) (5, 0);\n    TERM"))
    )
    assert [(t.kind, t.parameters) for t in system.outputs[0].terms] == [
        ("triangular", (0, 1, 2)),
        ("trapezoidal", (2, 3, 4, 5)),
        ("gaussian", (5, 1)),
    ]
    assert (system.inference, system.defuzzifier) == ("mamdani", "centroid")
    assert system.outputs[0].range == (0, 10)


def test_either_norm_stands_for_both(file):
    assert read_fcl(file(FAN.replace("AND : MIN", "OR : ASUM")))[0].and_ == "prod"
    assert read_fcl(file(FAN.replace("AND : MIN", "AND : BDIF")))[0].or_ == "lukasiewicz"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(27, 0);\n", "(27, 0.5);\n", "line 11: the term 'cold' has the heights 1, 0.5"),
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
