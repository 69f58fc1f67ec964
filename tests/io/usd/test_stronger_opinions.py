"""A result below stronger opinions is refused in place, and reported on an open stage."""

from pathlib import Path

import pytest
from processed import digests, shoot
from pxr import Sdf, Usd
from worlds import animation_of, make_world

from usdface.errors import OutputError
from usdface.io.usd.stronger_opinions import check_shown
from usdface.pipeline import apply, process, processing

WEIGHTS = "/Shot/Character/Face/Anim.blendShapeWeights"


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    return shoot(make_world().write(tmp_path))


def with_attribute(shot: Path, path: str, kind: Sdf.ValueTypeName, value: object) -> None:
    layer, place = Sdf.Layer.FindOrOpen(str(shot)), Sdf.Path(path)
    prim = Sdf.CreatePrimInLayer(layer, place.GetPrimPath())
    Sdf.AttributeSpec(prim, place.name, kind).default = value
    layer.Save()


def test_in_place_below_own_weights_is_refused_before_the_solve(
    shot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_attribute(shot, WEIGHTS, Sdf.ValueTypeNames.FloatArray, [0.1] * 12)
    before = digests(shot.parent)
    monkeypatch.setattr(processing, "retarget_run", lambda *_, **__: pytest.fail("it was solved"))
    with pytest.raises(OutputError, match=r"shot\.usda itself has </Shot.*blendShapeWeights>"):
        process(shot, in_place=True)
    assert digests(shot.parent) == before


def test_in_place_prints_nothing(shot: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """USD warns of a list where it stores an array."""
    process(shot, in_place=True)
    assert capfd.readouterr() == ("", "")


def test_beside_the_shot_it_shows(shot: Path) -> None:
    with_attribute(shot, WEIGHTS, Sdf.ValueTypeNames.FloatArray, [0.1] * 12)
    assert animation_of(process(shot).written[0]).weights.max() > 0.5


def test_in_place_leaves_nothing_where_another_value_is_hidden(shot: Path) -> None:
    with_attribute(shot, "/Shot/Retarget.usdface:residual", Sdf.ValueTypeNames.Float, 1.0)
    before = digests(shot.parent)
    with pytest.raises(OutputError, match=r"usdface:residual>, which would hide the result"):
        process(shot, in_place=True)
    assert digests(shot.parent) == before


def test_on_an_open_stage_it_is_reported(shot: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    apply(stage)
    for own in (False, True):
        stage.SetEditTarget(stage.GetSessionLayer())
        if own:
            stage.GetAttributeAtPath(WEIGHTS).Set([0.1] * 12)
        stage.SetEditTarget(stage.GetRootLayer())
        found = [each for each in apply(stage).findings if each.code == "RESULT_HIDDEN"]
        assert [each.values["names"] for each in found] == [[WEIGHTS]] * own


def test_edits_of_a_result_that_a_new_one_hides_are_reported(shot: Path) -> None:
    """An animator's layer over the result is processed, in place of the shot."""
    process(shot)
    edits = Sdf.Layer.CreateNew(str(shot.with_name("anim.usda")))
    edits.subLayerPaths.append("./shot.usdface.usda")
    edits.Save()
    assert "EDIT_HIDDEN" not in [
        each.code for each in process(shot.with_name("anim.usda")).findings
    ]
    with_attribute(shot.with_name("anim.usda"), WEIGHTS, Sdf.ValueTypeNames.FloatArray, [0.1] * 12)
    result = process(shot.with_name("anim.usda"))
    (found,) = [each for each in result.findings if each.code == "EDIT_HIDDEN"]
    assert found.where == "anim.usda" and found.values["names"] == [WEIGHTS]
    assert animation_of(result.written[0]).weights.max() > 0.5  # not the edits


def edits_in(shot: Path, **info: object) -> None:
    """Lay a layer with an opinion on the weights over all sublayers of a shot."""
    edits = Sdf.Layer.CreateNew(str(shot.with_name("edits.usda")))
    prim = Sdf.CreatePrimInLayer(edits, Sdf.Path(WEIGHTS).GetPrimPath())
    spec = Sdf.AttributeSpec(prim, "blendShapeWeights", Sdf.ValueTypeNames.FloatArray)
    for key, value in info.items():
        setattr(spec, key, value)
    edits.Save()
    layer = Sdf.Layer.FindOrOpen(str(shot))
    layer.subLayerPaths.insert(0, "./edits.usda")
    layer.Save()


@pytest.mark.parametrize("again_in_place", [False, True])
def test_edits_over_a_result_in_the_shot_itself_are_reported(
    shot: Path, again_in_place: bool
) -> None:
    """In place the new result is put first of the sublayers, as the old one was."""
    process(shot, in_place=True)
    edits_in(shot, default=[0.1] * 12)
    result = process(shot, in_place=again_in_place)
    assert animation_of(result.written[0]).weights.max() > 0.5  # not the edits
    found = [each.where for each in result.findings if each.code == "EDIT_HIDDEN"]
    assert found == ["edits.usda"]


def test_an_opinion_without_a_value_is_no_edit(shot: Path) -> None:
    process(shot, in_place=True)
    edits_in(shot, documentation="as the director wants it")
    assert "EDIT_HIDDEN" not in [each.code for each in process(shot).findings]


OURS = """over "A"
{
    uniform token[] names = ["a", "b"]
    float curve.timeSamples = {
        1: 1,
    }
    rel other = </A>
}
"""


@pytest.mark.parametrize(
    ("theirs", "hidden"),
    [
        ("", ""),
        ('uniform token[] names = ["a", "b"]', ""),
        ('uniform token[] names = ["b", "a"]', "names"),
        ("float curve", ""),
        ("float curve = 1", "curve"),
        ("float curve = None", "curve"),
        ("float curve.timeSamples = {\n1: 1,\n}", "curve"),
        ("rel other = </A>", ""),
        ("rel other = </B>", "other"),
        ("float more = 1", ""),
    ],
)
def test_what_hides(theirs: str, hidden: str) -> None:
    ours, stronger = (Sdf.Layer.CreateAnonymous(".usda") for _ in range(2))
    ours.ImportFromString(f"#usda 1.0\n{OURS}")
    stronger.ImportFromString(f'#usda 1.0\nover "A"\n{{\n{theirs}\n}}\n')
    if not hidden:
        return check_shown(ours, stronger)
    with pytest.raises(OutputError, match=rf"</A\.{hidden}>"):
        check_shown(ours, stronger)
    return None


def test_a_variant_is_weaker_than_all_that_is_outside_of_it(shot: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    stage.GetAttributeAtPath(WEIGHTS).Set([0.1] * 12)
    variants = stage.GetPrimAtPath("/Shot").GetVariantSets().AddVariantSet("version")
    variants.AddVariant("solved")
    variants.SetVariantSelection("solved")
    stage.SetEditTarget(variants.GetVariantEditTarget())
    codes = [each.code for each in apply(stage).findings]
    assert "RESULT_HIDDEN" in codes
