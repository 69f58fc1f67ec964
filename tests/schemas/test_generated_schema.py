"""What USD reads (generatedSchema.usda, plugInfo.json) is what schema.usda says."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import get_args

import pytest
from expression_systems import expression_system
from pxr import Sdf, Usd
from whole_setup import PLAIN, other_fields

from usdface import options
from usdface.expression_system import Axis, FaceUnit, MarkerFeature, Measure
from usdface.fuzzy import system
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Variable, VariableKind
from usdface.io.usd.retarget_setup import read_setup
from usdface.schemas import plugin_dir, tokens

SOURCE = Sdf.Layer.FindOrOpen(str(plugin_dir() / "schema.usda"))
CONTRACT = Path(__file__).parents[2] / "docs" / "architecture.md"
GENERATED = Sdf.Layer.FindOrOpen(str(plugin_dir() / "generatedSchema.usda"))
OWN = [spec.name for spec in SOURCE.rootPrims if spec.specifier == Sdf.SpecifierClass]


def properties(layer: Sdf.Layer, name: str) -> dict[str, dict[str, object]]:
    """Our own properties of a class, without prose: inherited ones differ between USDs."""
    skip = {"documentation", "customData"}
    return {
        prop.name: {key: prop.GetInfo(key) for key in prop.ListInfoKeys() if key not in skip}
        for prop in layer.GetPrimAtPath(f"/{name}").properties
        if prop.name.startswith("usdface:")
    }


def types(text: str) -> dict[str, dict[str, object]]:
    """The types of a plugInfo.json; usdGenSchema puts comment lines on top."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    declared: dict[str, dict[str, object]] = json.loads("\n".join(lines))["Plugins"][0]["Info"][
        "Types"
    ]
    return declared


@pytest.mark.parametrize("name", OWN)
def test_generated_schema_is_up_to_date(name: str) -> None:
    outdated = "run python -m pxr.Usd.usdGenSchema usdface/schemas/schema.usda usdface/schemas"
    assert properties(GENERATED, name) == properties(SOURCE, name) != {}, outdated


def test_plug_info_names_the_same_types() -> None:
    declared = types((plugin_dir() / "plugInfo.json").read_text(encoding="utf-8"))
    assert sorted(declared) == sorted(OWN)
    assert all(t["schemaKind"] == "concreteTyped" for t in declared.values())
    assert declared[tokens.MARKER_TAKE]["bases"] == ["UsdGeomPoints"]


@pytest.mark.slow
def test_usdgenschema_makes_the_same_files(tmp_path: Path) -> None:
    # Not imported here: usdGenSchema switches the schemas off for the whole process
    if not (find_spec("jinja2") and find_spec("pxr.Usd.usdGenSchema")):
        pytest.skip("usdGenSchema or its Jinja2 is not installed")
    source = plugin_dir() / "schema.usda"
    subprocess.run(
        [sys.executable, "-m", "pxr.Usd.usdGenSchema", "-q", source, tmp_path],
        check=True,
        capture_output=True,
    )
    again = Sdf.Layer.FindOrOpen(str(tmp_path / "generatedSchema.usda"))
    for name in OWN:
        assert properties(again, name) == properties(GENERATED, name)
    key = "fallbackPrimTypes"
    assert dict(again.pseudoRoot.GetInfo(key)) == dict(GENERATED.pseudoRoot.GetInfo(key))
    assert types((tmp_path / "plugInfo.json").read_text(encoding="utf-8")) == types(
        (plugin_dir() / "plugInfo.json").read_text(encoding="utf-8")
    )


def declared_default(prim: str, name: str) -> object:
    return GENERATED.GetAttributeAtPath(f"/{prim}.{name}").default


def test_a_missing_attribute_of_a_setup_means_its_default() -> None:
    """A prim with the declared defaults, as USD has them where nothing is authored."""
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Retarget")
    for spec in GENERATED.GetPrimAtPath(f"/{tokens.RETARGET}").attributes:
        if spec.name.startswith("usdface:") and spec.default is not None:
            prim.CreateAttribute(spec.name, spec.typeName, False).Set(spec.default)
    assert other_fields(read_setup(prim), PLAIN) == {"neutral_removed"}  # on a stage it is named


SOLVE = options.SolveOptions()
ROW = """    uniform {kind} {attribute} = {default} ({tokens}
        displayGroup = "Solve"
        displayName = "{label}"
        doc = \"\"\"{doc}\"\"\"
    )"""


@pytest.mark.parametrize("name", options.solve_settings())
def test_every_setting_of_the_solve_has_its_row(name: str) -> None:
    """The row of schema.usda is that of `SolveOptions`; where it is not, this says which to add."""
    setting, default = options.solve_settings()[name], getattr(SOLVE, name)
    allowed = list(get_args(setting.choices))
    attribute = f"{tokens.SOLVE_PREFIX}{name}"
    row = ROW.format(
        kind="token" if allowed else "double",
        attribute=attribute,
        default=json.dumps(default) if allowed else f"{default:g}",
        tokens=f"\n        allowedTokens = {json.dumps(allowed)}" if allowed else "",
        label=name.capitalize(),
        doc=setting.doc,
    )
    missing = f"in usdface/schemas/schema.usda, class {tokens.RETARGET}, write\n{row}"
    spec = SOURCE.GetAttributeAtPath(f"/{tokens.RETARGET}.{attribute}")
    assert spec, missing
    assert spec.default == default and spec.documentation == setting.doc, missing
    assert spec.displayName == name.capitalize() and spec.displayGroup == "Solve", missing
    assert list(spec.allowedTokens or ()) == allowed, missing


@pytest.mark.parametrize("name", options.solve_settings())
def test_every_setting_of_the_solve_has_its_line_in_the_contract(name: str) -> None:
    setting, default = options.solve_settings()[name], getattr(SOLVE, name)
    kind = "token" if setting.choices else "double"
    value = f"`{default}`" if setting.choices else f"{default:g}"
    line = f"| `{tokens.SOLVE_PREFIX}{name}` | uniform {kind} | {value} | {setting.doc} |"
    assert line in CONTRACT.read_text(encoding="utf-8").splitlines(), (
        f"in {CONTRACT.name} write\n{line}"
    )


SYSTEM = expression_system((), ())
VARIABLE = Variable("mouth", "input")
FEATURE = MarkerFeature("mouth")


@pytest.mark.parametrize(
    ("prim", "name", "value"),
    [
        (tokens.FUZZY_SYSTEM, tokens.NORMALISATION, SYSTEM.fuzzy.normalisation),
        (tokens.FUZZY_SYSTEM, tokens.AND, SYSTEM.fuzzy.and_),
        (tokens.FUZZY_SYSTEM, tokens.OR, SYSTEM.fuzzy.or_),
        (tokens.FUZZY_SYSTEM, tokens.INFERENCE, SYSTEM.fuzzy.inference),
        (tokens.FUZZY_SYSTEM, tokens.IMPLICATION, SYSTEM.fuzzy.implication),
        (tokens.FUZZY_SYSTEM, tokens.AGGREGATION, SYSTEM.fuzzy.aggregation),
        (tokens.FUZZY_SYSTEM, tokens.DEFUZZIFIER, SYSTEM.fuzzy.defuzzifier),
        (tokens.FUZZY_SYSTEM, tokens.SAMPLES, SYSTEM.fuzzy.samples),
        (tokens.FUZZY_SYSTEM, tokens.SAMPLING, SYSTEM.fuzzy.sampling),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_DEFAULT, VARIABLE.default),
        (tokens.FUZZY_SYSTEM, tokens.SPACE, SYSTEM.space),
        (tokens.FUZZY_SYSTEM, tokens.FACE_UNIT, SYSTEM.face_unit),
        (tokens.FUZZY_SYSTEM, tokens.NEUTRAL_RULE, SYSTEM.fuzzy.else_rule),
        (tokens.FUZZY_SYSTEM, tokens.RESPONSE, SYSTEM.response),
        (tokens.FUZZY_SYSTEM, tokens.FEATURE_SMOOTHING, SYSTEM.smoothing),
        (tokens.FUZZY_SYSTEM, tokens.BLEND_TIME, SYSTEM.blend_time),
        (tokens.FUZZY_SYSTEM, tokens.EVIDENCE, SYSTEM.evidence),
        (tokens.FUZZY_SYSTEM, tokens.LIKENESS, SYSTEM.likeness),
        (tokens.FUZZY_SYSTEM, tokens.EASE, options.CorrectionOptions().ease),
        (tokens.FUZZY_SYSTEM, tokens.MODE, options.CorrectionOptions().mode),
        (tokens.FUZZY_SYSTEM, tokens.GAIN, options.CorrectionOptions().gain),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_AXIS, FEATURE.axis),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_MEASURE, FEATURE.measure),
        (tokens.FUZZY_RULE, tokens.RULE_WEIGHT, parse_rule("IF a IS b THEN c IS 1").weight),
        (tokens.FUZZY_RULE, tokens.ENABLED, parse_rule("IF a IS b THEN c IS 1").enabled),
    ],
)
def test_a_missing_attribute_means_the_default_of_the_system(
    prim: str, name: str, value: object
) -> None:
    assert declared_default(prim, name) == value


@pytest.mark.parametrize(
    ("prim", "name", "allowed"),
    [
        (tokens.RETARGET, tokens.MAP_KERNEL, options.Kernel),
        (tokens.RETARGET, tokens.MAP_FORM, options.MapForm),
        (tokens.RETARGET, tokens.MAP_CHOICE, options.MapChoosing),
        (tokens.RETARGET, tokens.HEAD_MODE, options.HeadMode),
        (tokens.FUZZY_SYSTEM, tokens.MODE, options.CorrectionMode),
        (tokens.FUZZY_SYSTEM, tokens.NORMALISATION, system.Normalisation),
        (tokens.FUZZY_SYSTEM, tokens.AND, system.And),
        (tokens.FUZZY_SYSTEM, tokens.OR, system.Or),
        (tokens.FUZZY_SYSTEM, tokens.INFERENCE, system.Inference),
        (tokens.FUZZY_SYSTEM, tokens.IMPLICATION, system.And),
        (tokens.FUZZY_SYSTEM, tokens.AGGREGATION, system.Aggregation),
        (tokens.FUZZY_SYSTEM, tokens.DEFUZZIFIER, system.Defuzzifier),
        (tokens.FUZZY_SYSTEM, tokens.SAMPLING, system.Sampling),
        (tokens.FUZZY_SYSTEM, tokens.SPACE, options.FeatureSpace),
        (tokens.FUZZY_SYSTEM, tokens.FACE_UNIT, FaceUnit),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_KIND, VariableKind),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_AXIS, Axis),
        (tokens.FUZZY_VARIABLE, tokens.VARIABLE_MEASURE, Measure),
    ],
)
def test_allowed_tokens_are_those_of_the_program(prim: str, name: str, allowed: object) -> None:
    spec = GENERATED.GetAttributeAtPath(f"/{prim}.{name}")
    assert set(spec.allowedTokens) == set(get_args(allowed))


@pytest.mark.parametrize("name", OWN)
def test_every_property_is_documented_for_people(name: str) -> None:
    for prop in SOURCE.GetPrimAtPath(f"/{name}").properties:
        shown = ("documentation", "displayGroup", "displayName")
        assert all(prop.GetInfo(key) for key in shown), (
            f"{prop.name} in schema.usda lacks one of {shown}"
        )


@pytest.mark.parametrize("name", OWN)
def test_a_default_is_an_allowed_token(name: str) -> None:
    for prop in SOURCE.GetPrimAtPath(f"/{name}").properties:
        if prop.HasInfo("allowedTokens"):
            assert prop.default in prop.GetInfo("allowedTokens")
