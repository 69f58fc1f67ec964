"""Parts of a face and gains over a take, through USD."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, Vt
from slits import EXPRESSIONS, slit_face

from usdface.errors import InputError
from usdface.face.layout import FaceLayout, find_layout
from usdface.io.usd.face_layout import read_gains, read_layout, write_layout
from usdface.schemas import tokens

PARTS = find_layout(slit_face(), EXPRESSIONS, 0.0)
CODES = np.arange(5.0)


@pytest.fixture
def prim():
    stage = Usd.Stage.CreateInMemory()
    yield stage.DefinePrim("/Shot/Retarget", tokens.RETARGET)


def author(prim, name, kind, value):
    """Write what a file may hold, which UsdAttribute refuses where the schemas are registered."""
    prim.RemoveProperty(name)
    spec = prim.GetStage().GetRootLayer().GetPrimAtPath(prim.GetPath())
    Sdf.AttributeSpec(spec, name, getattr(Sdf.ValueTypeNames, kind)).default = value


def same(one: FaceLayout, other: FaceLayout) -> bool:
    names = ("left", "right", "antagonists", "tolerance")
    return (
        all(getattr(one, n) == getattr(other, n) for n in names)
        and dict(one.regions) == dict(other.regions)
        and np.array_equal(one.lips, other.lips)
        and np.array_equal(one.lids, other.lids)
    )


@pytest.mark.parametrize("unit", [1.0, 0.01, 0.001])
def test_what_is_written_is_read(prim, unit):
    write_layout(prim, PARTS, unit)
    assert same(read_layout(prim, unit), PARTS)
    # In stage units, as everything on the stage.
    assert prim.GetAttribute(tokens.CONTACT_TOLERANCE).Get() == pytest.approx(
        PARTS.tolerance / unit
    )


def test_what_is_not_authored_is_empty(prim):
    nothing = FaceLayout(regions={"brows": (), "eyes": (), "mouth": ()})
    assert same(read_layout(prim, 0.01), nothing)


def test_a_shot_can_say_otherwise(prim):
    write_layout(prim, PARTS, 1.0)
    prim.GetAttribute(tokens.CONTACT_LIPS).Set(Vt.Vec2iArray())
    prim.GetAttribute(tokens.BROWS_SHAPES).Set(Vt.TokenArray(["forehead"]))
    read = read_layout(prim, 1.0)
    assert read.lips.shape == (0, 2) and read.regions["brows"] == ("forehead",)


@pytest.mark.parametrize(
    ("name", "kind", "value", "message"),
    [
        (tokens.ANTAGONISTS, "TokenArray", Vt.TokenArray(["a", "b", "c"]), "3 entries"),
        (tokens.LEFT_SHAPES, "TokenArray", Vt.TokenArray(["mouthSmileRight"]), "both sides"),
        (tokens.CONTACT_LIPS, "IntArray", Vt.IntArray([1, 2]), "expected a"),
        (tokens.CONTACT_TOLERANCE, "Double", -1.0, "tolerance"),
        (tokens.CONTACT_TOLERANCE, "Token", "wide", "expected a"),
    ],
)
def test_what_cannot_be_is_refused_with_the_prim(prim, name, kind, value, message):
    write_layout(prim, PARTS, 1.0)
    author(prim, name, kind, value)
    with pytest.raises(InputError, match=message) as error:
        read_layout(prim, 1.0)
    assert "/Shot/Retarget" in str(error.value)


@pytest.fixture
def expressive():
    """A system and an expression that have gains."""
    stage = Usd.Stage.CreateInMemory()
    system = stage.DefinePrim("/Fuzzy", tokens.FUZZY_SYSTEM)
    joy = stage.DefinePrim("/joy", tokens.EXPRESSION)
    for prim, name in ((system, tokens.GAIN), (system, tokens.EYES_GAIN), (joy, tokens.GAIN)):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float, False)
    yield system, joy


def test_gains_are_read_between_their_samples(expressive):
    system, joy = expressive
    system.GetAttribute(tokens.GAIN).Set(0.7)
    system.GetAttribute(tokens.EYES_GAIN).Set(0.0, 1.0)
    system.GetAttribute(tokens.EYES_GAIN).Set(1.0, 3.0)
    joy.GetAttribute(tokens.GAIN).Set(2.0, 2.0)
    gains = read_gains(system, [joy], CODES)
    assert gains.system == 0.7  # exactly, though it is a float on the stage
    np.testing.assert_allclose(gains.regions["eyes"], [0, 0, 0.5, 1, 1])
    np.testing.assert_array_equal(gains.regions["mouth"], [1])
    np.testing.assert_array_equal(gains.emotions["joy"], [2])
    parts = [("joy", "eyes"), ("anger", "mouth")]
    np.testing.assert_allclose(gains.of(parts, 5)[:, 0], [0, 0, 1, 2, 2])


def test_nothing_authored_means_1(expressive):
    system, joy = expressive
    for gains in (read_gains(system, [joy], CODES), read_gains(None, [], CODES)):
        assert (gains.system == 1).all() and (gains.of([("joy", "eyes")], 5) == 1).all()


@pytest.mark.parametrize("bad", [-1.0, float("nan"), float("inf")])
def test_a_gain_that_cannot_be_is_refused_with_the_prim(expressive, bad):
    system, joy = expressive
    joy.GetAttribute(tokens.GAIN).Set(bad, 3.0)
    joy.GetAttribute(tokens.GAIN).Set(1.0, 0.0)
    with pytest.raises(InputError, match=r"</joy>.*gain"):
        read_gains(system, [joy], CODES)


def test_a_gain_of_another_type_is_refused(expressive):
    system, joy = expressive
    author(system, tokens.MOUTH_GAIN, "Float2", Gf.Vec2f(1, 1))
    with pytest.raises(InputError, match="mouth:gain"):
        read_gains(system, [joy], CODES)
