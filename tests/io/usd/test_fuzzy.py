from math import inf

import pytest
from expression_systems import expression_system
from pxr import Sdf, Usd

from usdface.errors import InputError, OutputError
from usdface.expression_system import MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.usd.fuzzy import read_fuzzy, write_fuzzy
from usdface.rule_design.paper_system import paper_system
from usdface.schemas import tokens

PATH = "/Shot/Fuzzy"
MOUTH = Variable(
    "mouth_y",
    "input",
    (
        Term("raised", "ramp", (0.01, 0.1)),
        Term("lowered", "triangular", (-inf, -0.2, -0.05)),
        Term("level", "trapezoidal", (-0.1, -0.01, 0.01, 0.1)),
    ),
)
SYSTEM = expression_system(
    (
        MOUTH,
        Variable("rule_01", "output"),
        Variable("brow_x", "input"),
        Variable("joy", "output"),
    ),
    (
        parse_rule("IF mouth_y IS raised\n  AND mouth_y IS level THEN joy IS 0.7", 0.3),
        parse_rule("if mouth_y is lowered then rule_01 is 1", enabled=False),
        *(parse_rule(f"IF mouth_y IS raised THEN joy IS {i / 20}") for i in range(12)),
    ),
    (MarkerFeature("mouth"), MarkerFeature("brow", "x", "absolute")),
    normalisation="per_output",
    and_="prod",
    else_rule=False,
    space="take",
    face_unit="none",
    mode="add",
    gain=1.2,
)


@pytest.fixture
def stage():
    return Usd.Stage.CreateInMemory()


@pytest.mark.parametrize("system", [SYSTEM, paper_system(), expression_system((), ())])
def test_what_is_written_is_read(stage, system):
    write_fuzzy(stage, PATH, system)
    assert read_fuzzy(stage, PATH) == system


def test_it_survives_a_file(stage, tmp_path):
    write_fuzzy(stage, PATH, SYSTEM)
    for name in ("system.usda", "system.usdc"):
        stage.GetRootLayer().Export(str(tmp_path / name))
        assert read_fuzzy(Usd.Stage.Open(str(tmp_path / name)), PATH) == SYSTEM


def test_names_and_types_are_those_of_the_contract(stage):
    write_fuzzy(stage, PATH, SYSTEM)
    prims = {p.GetName(): p for p in stage.GetPrimAtPath(PATH).GetChildren()}
    assert list(prims)[:4] == ["mouth_y", "rule_01", "brow_x", "joy"]
    system, rule = stage.GetPrimAtPath(PATH), prims["rule_02"]
    for prim, name, kind, uniform in [
        (system, "usdface:normalisation", "token", True),
        (system, "usdface:faceUnit", "token", True),
        (system, "usdface:neutralRule", "bool", True),
        (system, "usdface:gain", "float", False),
        (prims["mouth_y"], "usdface:terms:names", "token[]", True),
        (prims["mouth_y"], "usdface:terms:parameters", "double[]", True),
        (prims["mouth_y"], "usdface:terms:counts", "int[]", True),
        (rule, "usdface:text", "string", True),
        (rule, "usdface:weight", "float", False),
        (rule, "usdface:enabled", "bool", False),
    ]:
        attribute = prim.GetAttribute(name)
        assert attribute.GetTypeName() == kind
        assert (attribute.GetVariability() == Sdf.VariabilityUniform) == uniform
        assert not attribute.IsCustom()


def shot_over(stage):
    """Return a stage over the system's layer; edits go to the stronger layer."""
    write_fuzzy(stage, PATH, SYSTEM)
    shot = Usd.Stage.CreateInMemory()
    shot.GetRootLayer().subLayerPaths.append(stage.GetRootLayer().identifier)
    return shot


def test_a_stronger_layer_overrides_one_thing_sparsely(stage):
    shot = shot_over(stage)
    rules = [p for p in shot.GetPrimAtPath(PATH).GetChildren() if p.GetTypeName().endswith("Rule")]
    rules[5].GetAttribute(tokens.ENABLED).Set(False)
    wider = [0.02, 0.4, *MOUTH.terms[1].parameters, *MOUTH.terms[2].parameters]
    shot.GetPrimAtPath(f"{PATH}/mouth_y").GetAttribute(tokens.TERMS_PARAMETERS).Set(wider)
    shot.GetPrimAtPath(PATH).GetAttribute(tokens.GAIN).Set(0.25)
    read = read_fuzzy(shot, PATH)
    assert [r.text for r in read.fuzzy.rules] == [r.text for r in SYSTEM.fuzzy.rules]
    assert [r.enabled for r in read.fuzzy.rules] == [i not in (1, 5) for i in range(14)]
    assert read.fuzzy.inputs[0].term("raised").parameters == (0.02, 0.4)
    assert read.fuzzy.inputs[0].terms[1:] == MOUTH.terms[1:]
    assert read.gain == 0.25
    assert read_fuzzy(stage, PATH) == SYSTEM


def test_a_rule_can_be_added_and_one_taken_away(stage):
    shot = shot_over(stage)
    shot.GetPrimAtPath(f"{PATH}/rule_03").SetActive(False)
    added = shot.DefinePrim(f"{PATH}/a_new_rule", tokens.FUZZY_RULE)
    text = "IF mouth_y IS level THEN joy IS 0"
    added.CreateAttribute(tokens.RULE_TEXT, Sdf.ValueTypeNames.String, False).Set(text)
    expected = [*SYSTEM.fuzzy.rules[:2], *SYSTEM.fuzzy.rules[3:], parse_rule(text)]
    assert read_fuzzy(shot, PATH).fuzzy.rules == tuple(expected)


def test_missing_attributes_have_their_defaults(stage):
    stage.DefinePrim(PATH, tokens.FUZZY_SYSTEM)
    stage.DefinePrim(f"{PATH}/Notes", "Scope")
    variable = stage.DefinePrim(f"{PATH}/a", tokens.FUZZY_VARIABLE)
    variable.CreateAttribute(tokens.VARIABLE_ROLE, Sdf.ValueTypeNames.Token, False).Set("a")
    assert read_fuzzy(stage, PATH) == expression_system((Variable("a", "input"),), ())


@pytest.mark.parametrize(
    ("child", "name", "kind", "value", "says"),
    [
        ("", tokens.MODE, "Token", "lower", "mode .* 'lower'"),
        ("", tokens.GAIN, "Float", float("nan"), "gain"),
        ("", tokens.GAIN, "String", "much", "usdface:gain holds a str; expected a float"),
        ("/mouth_y", tokens.VARIABLE_KIND, "Token", "both", "'both'; expected input or output"),
        ("/mouth_y", tokens.VARIABLE_ROLE, "Token", "", "has no role"),
        ("/mouth_y", tokens.TERMS_KINDS, "TokenArray", ["ramp"], "3 terms have 1 kinds"),
        ("/mouth_y", tokens.TERMS_COUNTS, "IntArray", [2, 3, 2**30], "parameters of terms"),
        ("/mouth_y", tokens.TERMS_COUNTS, "IntArray", [2, -3, 10], "parameters of terms"),
        ("/mouth_y", tokens.TERMS_COUNTS, "IntArray", [3, 2, 4], "expected 2 parameters"),
        ("/mouth_y", tokens.TERMS_PARAMETERS, "DoubleArray", [float("nan")] * 9, "not a number"),
        ("/mouth_y", tokens.TERMS_NAMES, "TokenArray", ["a", "b", "c"], "no term 'raised'"),
        ("/rule_02", tokens.RULE_TEXT, "String", "IF x", "line 1, column 5: expected IS"),
        ("/rule_02", tokens.RULE_TEXT, "String", "IF x IS y THEN joy IS 1", "no input .* 'x'"),
        ("/rule_02", tokens.RULE_WEIGHT, "Float", -1.0, "weight is -1"),
        ("/rule_02", tokens.ENABLED, "String", "yes", "holds a str"),
    ],
)
def test_nonsense_names_the_prim(stage, child, name, kind, value, says):
    write_fuzzy(stage, PATH, SYSTEM)
    stage.GetPrimAtPath(PATH + child).RemoveProperty(name)
    # On the layer, where other programs may write what the registered schemas forbid.
    prim = stage.GetRootLayer().GetPrimAtPath(PATH + child)
    Sdf.AttributeSpec(prim, name, getattr(Sdf.ValueTypeNames, kind)).default = value
    with pytest.raises(InputError, match=says) as error:
        read_fuzzy(stage, PATH)
    assert str(error.value).startswith(f"prim <{PATH}")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("path", ["/Nothing", "/Shot", "not a path", ""])
def test_no_system_there(stage, path):
    stage.DefinePrim("/Shot", "Scope")
    with pytest.raises(InputError, match="is not a UsdFaceFuzzySystem"):
        read_fuzzy(stage, path)


def test_what_is_there_is_not_overwritten(stage):
    write_fuzzy(stage, PATH, SYSTEM)
    with pytest.raises(OutputError, match="already has children"):
        write_fuzzy(stage, PATH, paper_system())
    assert read_fuzzy(stage, PATH) == SYSTEM


def test_a_bad_path_is_refused(stage):
    with pytest.raises(OutputError):
        write_fuzzy(stage, "not a path", SYSTEM)
