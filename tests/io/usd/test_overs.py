"""Results on a host's stage: all or nothing, in the variant of the edit target."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import make_world

import usdface
from usdface.io.usd import overs
from usdface.io.usd.overs import put_overs


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("overs"))
    files = [folder / name for name in ("rig.usda", "take.usda", "shot.usda")]
    usdface.make_shot(*files, bind=folder / "bind.json")
    return files[-1]


def prepared(text: str) -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(f"#usda 1.0\n{text}")
    return layer


OLD = """over "A" (
    prepend apiSchemas = ["Theirs"]
)
{
    float w.timeSamples = {
        1: 1,
        9: 9,
    }
    double other = 1
    float stale = 2
}
"""
NEW = """over "A" (
    prepend apiSchemas = ["Ours"]
)
{
    float w.timeSamples = {
        1: 5,
    }

    over "B"
    {
        float v = 1
    }
}
"""


def test_properties_are_replaced_whole() -> None:
    stage = Usd.Stage.Open(prepared(OLD))
    assert put_overs(prepared(NEW), stage, lambda name: name == "stale") == []
    layer = stage.GetRootLayer()
    assert layer.ListTimeSamplesForPath("/A.w") == [1.0]
    assert layer.GetAttributeAtPath("/A.other") and not layer.GetAttributeAtPath("/A.stale")
    assert layer.GetAttributeAtPath("/A/B.v").default == 1
    applied = layer.GetPrimAtPath("/A").GetInfo("apiSchemas")
    assert list(applied.prependedItems) == ["Ours", "Theirs"]


def test_another_type_is_announced() -> None:
    stage = Usd.Stage.Open(prepared('over "A"\n{\n    string w = "x"\n}\n'))
    (found,) = put_overs(prepared(NEW), stage)
    assert found.code == "ATTRIBUTE_REPLACED" and "string" in found.message
    assert stage.GetRootLayer().GetAttributeAtPath("/A.w").typeName == "float"


@pytest.mark.parametrize("fault", [KeyboardInterrupt, RuntimeError])
def test_a_failure_leaves_the_layer_as_it_was(
    monkeypatch: pytest.MonkeyPatch, fault: type[BaseException]
) -> None:
    stage = Usd.Stage.Open(prepared(OLD))
    before = stage.GetRootLayer().ExportToString()
    put, calls = overs._put, []

    def failing(*given: object) -> object:
        calls.append(put(*given))  # type: ignore[arg-type]
        if len(calls) == 2:
            raise fault
        return calls[-1]

    monkeypatch.setattr(overs, "_put", failing)
    with pytest.raises(fault):
        put_overs(prepared(NEW), stage, lambda name: name == "stale")
    assert stage.GetRootLayer().ExportToString() == before


def test_a_defined_prim_need_not_have_a_type() -> None:
    stage = Usd.Stage.Open(prepared('def "A"\n{\n    float w = 3\n}\n'))
    before = stage.GetRootLayer().ExportToString()
    assert put_overs(prepared(NEW), stage) == []
    assert stage.GetRootLayer().GetAttributeAtPath("/A/B.v").default == 1
    refused = Usd.Stage.Open(prepared(before))
    with pytest.raises(KeyboardInterrupt), pytest.MonkeyPatch.context() as patch:
        patch.setattr(overs, "_put", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        put_overs(prepared(NEW), refused)
    assert refused.GetRootLayer().ExportToString() == before


def test_one_notice_tells_of_the_change() -> None:
    from pxr import Tf

    stage, seen = Usd.Stage.Open(prepared(OLD)), []
    listener = Tf.Notice.Register(Usd.Notice.ObjectsChanged, lambda *_: seen.append(1), stage)
    put_overs(prepared(NEW), stage)
    listener.Revoke()
    assert len(seen) == 1


def test_a_variant_as_edit_target(shot: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    variants = stage.GetPrimAtPath("/Shot").GetVariantSets().AddVariantSet("version")
    for name in ("plain", "solved"):
        variants.AddVariant(name)
    variants.SetVariantSelection("solved")
    stage.SetEditTarget(variants.GetVariantEditTarget(stage.GetSessionLayer()))
    weights = usdface.apply(stage).value.weights
    animation = next(p for p in stage.Traverse() if p.GetTypeName() == "SkelAnimation")
    attribute = animation.GetAttribute("blendShapeWeights")
    assert attribute.GetNumTimeSamples() == len(weights.times)
    played = attribute.Get(attribute.GetTimeSamples()[-9])
    np.testing.assert_allclose(played, weights.weights[-9], atol=1e-6)
    stage.SetEditTarget(stage.GetSessionLayer())
    variants.SetVariantSelection("plain")
    assert not attribute.GetTimeSamples()


@pytest.mark.slow
def test_a_shorter_result_leaves_nothing_of_a_longer_one(shot: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    usdface.apply(stage)
    once = stage.GetSessionLayer().ExportToString()
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    retarget.GetAttribute("usdface:residual").Set(9.0, 999.0)
    retarget.CreateAttribute("usdface:residual:ears", Sdf.ValueTypeNames.Float).Set(1.0)
    usdface.apply(stage)
    assert stage.GetSessionLayer().ExportToString() == once
