from collections.abc import Iterator

import pytest
from pxr import Gf, Sdf, Ts, Usd, Vt

from usdface.errors import InputError
from usdface.io.usd.attributes import author, changes, value_of


@pytest.fixture
def prim() -> Iterator[Usd.Prim]:
    stage = Usd.Stage.CreateInMemory()  # a prim lives as long as its stage
    yield stage.DefinePrim("/P", "Scope")


def test_what_is_authored_is_read_and_no_custom_attribute(prim: Usd.Prim) -> None:
    author(prim, "usdface:a", Sdf.ValueTypeNames.Double, 0.5)
    author(prim, "usdface:b", Sdf.ValueTypeNames.Float, 1.0, Sdf.VariabilityVarying)
    assert value_of(prim, "usdface:a", float) == 0.5
    assert not prim.GetAttribute("usdface:a").IsCustom()
    assert prim.GetAttribute("usdface:a").GetVariability() == Sdf.VariabilityUniform
    assert prim.GetAttribute("usdface:b").GetVariability() == Sdf.VariabilityVarying


def test_another_type_is_refused_and_nothing_is_none(prim: Usd.Prim) -> None:
    author(prim, "usdface:a", Sdf.ValueTypeNames.String, "much")
    assert value_of(prim, "usdface:none", float) is None
    with pytest.raises(InputError, match=r"usdface:a holds a str; expected a float"):
        value_of(prim, "usdface:a", float)


def test_only_values_that_differ_change(prim: Usd.Prim) -> None:
    points = prim.CreateAttribute("points", Sdf.ValueTypeNames.Float3Array)
    assert not changes(points)
    for code in (1.0, 2.0):
        points.Set(Vt.Vec3fArray([Gf.Vec3f(1, 2, 3)]), code)
    assert not changes(points)
    points.Set(Vt.Vec3fArray([Gf.Vec3f(1, 2, 4)]), 3.0)
    assert changes(points)
    curve = prim.CreateAttribute("curve", Sdf.ValueTypeNames.Double)
    spline = Ts.Spline()
    for code in (1.0, 2.0):
        spline.SetKnot(Ts.Knot(time=code, value=code))
    curve.SetSpline(spline)
    assert changes(curve)
