"""Wrong or doubtful fuzzy systems, through the commands: rule, place and remedy are named."""

import json
from pathlib import Path

import pytest
from expression_systems import expression_system
from pxr import Sdf, Usd
from worlds import make_world

from usdface.cli import main
from usdface.expression_system import MarkerFeature, Measure
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.schemas import tokens

TERMS = (Term("low", "ramp", (-0.1, -0.5)), Term("high", "ramp", (0.1, 0.5)))
BOTH = "IF brow_y IS high AND lip_y IS high THEN joy IS 1"
TEXTS = (".fis", ".fcl", ".fll")


def write(
    place: Path, *rules: str, role: str = "brow", measure: Measure = "signed", range_=None
) -> Path:
    brow = Variable("brow_y", "input", TERMS, range_)
    lip = Variable("lip_y", "input", terms=TERMS)
    made = tuple(map(parse_rule, rules or (BOTH,)))
    features = MarkerFeature(role, "y", measure), MarkerFeature("lip_lower")
    variables = brow, lip, Variable("joy", "output")
    write_fuzzy_file(place, expression_system(variables, made, features))
    return place


def convert(source: Path, capsys, *more: str) -> tuple[int, dict]:
    out = source.with_name("out.usda")
    out.unlink(missing_ok=True)
    status = main(["fuzzy", "convert", str(source), "-o", str(out), "--format", "json", *more])
    printed = json.loads(capsys.readouterr().out)
    assert ("error" in printed) != out.exists()
    return status, printed


def line_of(place: Path, text: str) -> int:
    lines = place.read_text().splitlines()
    return next(i for i, line in enumerate(lines, 1) if text in line)


@pytest.mark.parametrize("suffix", [".fcl", ".fll"])
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "brow_y {} high",
            "nose_y {} high",
            "no input is called 'nose_y'; there are brow_y, lip_y",
        ),
        ("brow_y {} high", "brow_y {} far", "brow_y has no term 'far'; it has low, high"),
        ("joy {} value_1", "rage {} value_1", "no output is called 'rage'; there are joy"),
        ("joy {} value_1", "joy {} loud", "joy has no term 'loud'"),
    ],
)
def test_an_unknown_name_is_refused_with_rule_line_and_remedy(
    tmp_path, capsys, suffix, old, new, says
):
    place = write(tmp_path / f"a{suffix}")
    is_ = "IS" if suffix == ".fcl" else "is"
    old, new = old.format(is_), new.format(is_)
    line = line_of(place, old)
    place.write_text(place.read_text().replace(old, new))
    status, result = convert(place, capsys)
    message = result["error"]["message"]
    assert status == 1 and message.startswith(f'a{suffix}, line {line}: rule "IF ')
    assert says in message and ("correct the rule" in message or "give it a number" in message)


def test_an_index_of_a_fis_that_names_no_term_is_refused(tmp_path, capsys):
    place = write(tmp_path / "a.fis")
    line = line_of(place, "2 2, 1")
    place.write_text(place.read_text().replace("2 2, 1", "2 5, 1"))
    status, result = convert(place, capsys)
    assert (
        status == 1 and f'a.fis, line {line}: rule "2 5, 1 (1) : 1"' in result["error"]["message"]
    )
    assert "lip_y has no term 5; it has 2" in result["error"]["message"]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("'linsmf',[0.1 0.5]", "'mymf',[0.1 0.5]", "'mymf' has no counterpart; expected one of"),
        ("AndMethod='min'", "AndMethod='myand'", "AndMethod 'myand' has no counterpart; expected"),
        ("DefuzzMethod='wtaver'", "DefuzzMethod='mine'", "DefuzzMethod 'mine' has no counterpart"),
        ("Type='sugeno'", "Type='tsukamoto'", "Type 'tsukamoto' has no counterpart"),
        ("2 2, 1 (1) : 1", "2 2, -1 (1) : 1", "a conclusion with NOT has no counterpart"),
    ],
)
def test_what_of_a_fis_has_no_counterpart_is_named_with_its_line(tmp_path, capsys, old, new, says):
    place = write(tmp_path / "a.fis")
    line = line_of(place, old)
    place.write_text(place.read_text().replace(old, new, 1))
    status, result = convert(place, capsys)
    assert status == 1 and says in result["error"]["message"]
    assert result["error"]["message"].startswith(f"a.fis, line {line}: ")


DOUBTS = {
    "RULE_UNREACHABLE": (
        BOTH,
        "IF brow_y IS high AND lip_y IS low AND brow_y IS low THEN joy IS 1",
    ),
    "RULES_CONTRADICT": (BOTH, BOTH.replace("joy IS 1", "joy IS 0.25")),
    "RULE_FIRES_AT_NEUTRAL": (BOTH, "IF brow_y IS NOT high THEN joy IS 1"),
}


@pytest.mark.parametrize("suffix", [".fcl", ".fll", ".usda"])
@pytest.mark.parametrize("code", DOUBTS)
def test_a_doubtful_rule_is_a_warning_with_its_place_and_an_action(tmp_path, capsys, suffix, code):
    rules = DOUBTS[code]
    place = write(tmp_path / f"a{suffix}", *rules)
    status, result = convert(place, capsys)
    (found,) = (f for f in result["findings"] if f["code"] == code)
    text = rules[1].partition(" THEN ")[0].casefold()
    assert text in found["values"]["rule"].casefold()
    assert found["severity"] == "warning" and status == 0
    assert found["action"] == "correct_rules"
    if suffix == ".usda":
        assert found["where"] == "prim </Fuzzy/rule_02>"
    else:
        number = found["where"].removeprefix(f"a{suffix}, line ")
        assert text in place.read_text().splitlines()[int(number) - 1].casefold()
    assert convert(place, capsys, "--strict")[0] == 1


@pytest.mark.parametrize("suffix", [*TEXTS, ".usda"])
def test_a_range_that_no_term_covers_is_a_warning(tmp_path, capsys, suffix):
    place = write(tmp_path / f"a{suffix}", range_=(-1, 1))
    _, result = convert(place, capsys)
    (found,) = (f for f in result["findings"] if f["code"] == "RANGE_UNCOVERED")
    assert found["where"] == "brow_y" and "-0.1 to 0.1" in found["values"]["ranges"]
    assert found["action"] == "correct_rules"


def test_an_absolute_distance_is_never_negative(tmp_path, capsys):
    rules = (BOTH, "IF brow_y IS low THEN joy IS 1")
    signed = write(tmp_path / "a.fll", *rules)
    assert "RULE_UNREACHABLE" not in {f["code"] for f in convert(signed, capsys)[1]["findings"]}
    place = write(tmp_path / "b.fll", *rules, measure="absolute")
    findings = convert(place, capsys)[1]["findings"]
    (found,) = (f for f in findings if f["code"] == "RULE_UNREACHABLE")
    assert "brow_y is low" in found["values"]["rule"].casefold()


@pytest.fixture(scope="module")
def shot(tmp_path_factory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("systems"))
    assert main(shot_command(folder, folder / "shot.usda")) == 0
    return folder / "shot.usda"


def shot_command(folder: Path, out: Path, *more: object) -> list[str]:
    sources = [("--rig", "rig.usda"), ("--take", "take.usda"), ("--bind", "bind.json")]
    named = [str(x) for option, name in sources for x in (option, folder / name)]
    return ["shot", *named, "-o", str(out), *map(str, more)]


def test_a_role_that_no_marker_plays_is_refused_with_a_remedy(shot, tmp_path, capsys):
    system = write(tmp_path / "a.fll", role="left_horn")
    assert main(shot_command(shot.parent, tmp_path / "shot.usda", "--fuzzy", system)) == 1
    printed = capsys.readouterr().err
    assert "marker role 'left_horn', which no bound marker has" in printed
    assert '"roles": {"left_horn": "..."}' in printed
    assert not (tmp_path / "shot.usda").exists()


def test_all_roles_that_no_marker_plays_are_named_at_once(shot, tmp_path, capsys):
    folder, system = shot.parent, tmp_path / "paper.usda"
    assert main(["fuzzy", "paper", "-o", str(system)]) == 0
    assert main(shot_command(folder, tmp_path / "shot.usda", "--fuzzy", system)) == 1
    printed = capsys.readouterr().err
    assert "'l_eyebrow_end', 'l_orbital_upper'" in printed and '"l_orbital_upper": "..."' in printed


def test_a_marker_may_play_several_roles(shot, tmp_path):
    folder, system, bind = shot.parent, tmp_path / "paper.usda", tmp_path / "bind.json"
    assert main(["fuzzy", "paper", "-o", str(system)]) == 0
    document = json.loads((folder / "bind.json").read_text())
    document["roles"] = {f.role: "lip_lower" for f in read_fuzzy_file(system)[0].features}
    bind.write_text(json.dumps(document))
    command = shot_command(folder, tmp_path / "shot.usda", "--fuzzy", system)
    command[command.index("--bind") + 1] = str(bind)
    assert main(command) == 0


def test_a_shot_of_a_doubtful_system_says_so(shot, tmp_path, capsys):
    system = write(tmp_path / "a.fll", *DOUBTS["RULES_CONTRADICT"])
    out = tmp_path / "shot.usda"
    assert main(shot_command(shot.parent, out, "--fuzzy", system, "--format", "json")) == 0
    codes = [f["code"] for f in json.loads(capsys.readouterr().out)["findings"]]
    assert codes.count("RULES_CONTRADICT") == 1


@pytest.mark.parametrize(
    ("kind", "name", "value", "says"),
    [
        (
            tokens.FUZZY_RULE,
            tokens.RULE_TEXT,
            "IF horn_y IS up THEN joy IS 1",
            "no input is called",
        ),
        (tokens.FUZZY_RULE, tokens.RULE_TEXT, "IF", "line 1, column 3: expected a variable"),
        (
            tokens.FUZZY_VARIABLE,
            tokens.VARIABLE_ROLE,
            "horn",
            "there is no marker 'horn'; name it in the binding",
        ),
        (tokens.FUZZY_VARIABLE, tokens.TERMS_KINDS, ["wave"], "unknown kind of term 'wave'"),
    ],
)
def test_a_system_that_cannot_run_writes_no_layer(shot, capsys, kind, name, value, says):
    # Of its own: an error that waits for the garbage collector keeps a shared one, as edited.
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(shot)))
    prims = stage.GetPrimAtPath("/Shot/Fuzzy").GetChildren()
    prim = next(p for p in prims if p.GetTypeName() == kind)
    if name == tokens.TERMS_KINDS:
        value = value * len(prim.GetAttribute(name).Get())
    prim.GetAttribute(name).Set(value)
    bad = shot.with_name("bad.usda")
    stage.GetRootLayer().Export(str(bad))
    before = sorted(shot.parent.rglob("*"))
    assert main(["process", str(bad)]) == 1
    printed = capsys.readouterr().err
    assert says in printed and printed.count("\n") == 1
    if kind == tokens.FUZZY_RULE:
        assert f"prim <{prim.GetPath()}>" in printed
    assert sorted(shot.parent.rglob("*")) == before
