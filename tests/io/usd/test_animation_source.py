"""A rig without a SkelAnimation gets one that UsdSkel finds."""

from pathlib import Path

import pytest
from processed import shoot, without_animation
from pxr import Sdf, Usd, UsdGeom, UsdSkel
from worlds import animation_of, make_world

from usdface.errors import InputError
from usdface.io.usd.animation_source import add_applied_schema
from usdface.pipeline import apply, check, process

BINDING = "SkelBindingAPI"


def only(stage: Usd.Stage, kind: type) -> Usd.Prim:
    (found,) = (prim for prim in stage.Traverse() if prim.IsA(kind))
    return found


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot whose rig has no SkelAnimation, and SkelBindingAPI on its mesh alone."""
    folder = without_animation(make_world().write(tmp_path_factory.mktemp("unapplied")))
    stage = Usd.Stage.Open(str(folder / "rig.usda"))
    skeleton, mesh = only(stage, UsdSkel.Skeleton), only(stage, UsdGeom.Mesh)
    UsdSkel.BindingAPI(mesh).CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    for prim in (skeleton, only(stage, UsdSkel.Root)):
        prim.RemoveAppliedSchema(BINDING)
    skeleton.AddAppliedSchema("GeomModelAPI")
    stage.Save()
    return shoot(folder)


def applied(stage: Usd.Stage) -> list[str]:
    return only(stage, UsdSkel.Skeleton).GetAppliedSchemas()


def test_a_result_plays_where_the_skeleton_lacks_the_schema(shot: Path) -> None:
    root = process(shot).written[0]
    assert animation_of(root).weights.max() > 0.5
    assert applied(Usd.Stage.Open(str(root))) == [BINDING, "GeomModelAPI"]


def test_so_it_does_on_an_open_stage(shot: Path) -> None:
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    for _ in range(2):
        apply(stage)
        assert animation_of(stage).weights.max() > 0.5
        assert applied(stage) == [BINDING, "GeomModelAPI"]


def inactive(folder: Path, path: str) -> Path:
    """A layer over the shot of a folder in which a prim is inactive."""
    shot = shoot(make_world().write(folder))
    layer = folder / "over.usda"
    stage = Usd.Stage.CreateNew(str(layer))
    stage.GetRootLayer().subLayerPaths.append(f"./{shot.name}")
    for metadata in ("metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond"):
        stage.SetMetadata(metadata, Usd.Stage.Open(str(shot)).GetMetadata(metadata))
    stage.OverridePrim(path).SetActive(False)
    stage.Save()
    return layer


def test_where_the_animation_is_inactive_there_is_one_that_plays(tmp_path: Path) -> None:
    layer = inactive(tmp_path, "/Shot/Character/Face/Anim")
    assert {f.code for f in check(layer).findings} == {"BINDING_TARGET_MISSING"}
    done = process(layer)
    assert "ANIMATION_CREATED" in {f.code for f in done.findings}
    stage = Usd.Stage.Open(str(done.written[0]))
    codes = range(int(stage.GetStartTimeCode()), int(stage.GetEndTimeCode()) + 1)
    cache, root = UsdSkel.Cache(), UsdSkel.Root(only(stage, UsdSkel.Root))
    cache.Populate(root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(UsdSkel.Skeleton(only(stage, UsdSkel.Skeleton))).GetAnimQuery()
    played = [query.ComputeBlendShapeWeights(code) for code in codes]
    assert max(map(max, played)) > 0.5


def test_an_inactive_skeleton_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no active skel:skeleton"):
        process(inactive(tmp_path, "/Shot/Character/Face/Skel"))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("", f'(prepend apiSchemas = ["{BINDING}"])'),
        ('(prepend apiSchemas = ["A"])', f'(prepend apiSchemas = ["{BINDING}", "A"])'),
        ('(apiSchemas = ["A"])', f'(apiSchemas = ["{BINDING}", "A"])'),
        (f'(append apiSchemas = ["{BINDING}"])', f'(append apiSchemas = ["{BINDING}"])'),
    ],
)
def test_a_schema_is_applied_beside_others(before: str, after: str) -> None:
    given, expected = (Sdf.Layer.CreateAnonymous(".usda") for _ in range(2))
    for layer, schemas in ((given, before), (expected, after)):
        layer.ImportFromString(f'#usda 1.0\nover "A" {schemas} {{\n}}\n')
    add_applied_schema(given.GetPrimAtPath("/A"), BINDING)
    assert given.ExportToString() == expected.ExportToString()
