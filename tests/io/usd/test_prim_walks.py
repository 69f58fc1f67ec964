from pxr import Usd, UsdGeom

from usdface.io.usd.prim_walks import lineage, prims_without


def names(prims) -> list[str]:
    return [prim.GetName() for prim in prims]


def stage_of(*paths: str) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    for path in paths:
        kind = "PointInstancer" if path.endswith("scatter") else "Xform"
        stage.DefinePrim(path, kind)
    return stage


def test_a_lineage_ends_below_the_root() -> None:
    stage = stage_of("/a/b/c")
    assert names(lineage(stage.GetPrimAtPath("/a/b/c"))) == ["c", "b", "a"]
    assert not names(lineage(stage.GetPseudoRoot()))
    assert not names(lineage(Usd.Prim()))


def test_prototypes_below_an_instancer_are_passed_by() -> None:
    stage = stage_of("/head/eye", "/scatter", "/scatter/prototype/leaf", "/tail")
    top = stage.GetPseudoRoot()
    assert names(prims_without(top, UsdGeom.PointInstancer))[1:] == ["head", "eye", "tail"]
    assert "leaf" in names(prims_without(top))
    # The prim that the walk begins at is no exception.
    assert not names(prims_without(stage.GetPrimAtPath("/scatter"), UsdGeom.PointInstancer))
