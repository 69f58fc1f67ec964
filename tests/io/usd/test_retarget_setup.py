"""The setup of a face survives USD; nonsense is refused."""

import numpy as np
import pytest
from pxr import Sdf, Usd, Vt
from whole_setup import PLAIN, lost_fields, other_fields

from usdface.errors import InputError
from usdface.io.usd.retarget_setup import read_setup, write_setup
from usdface.options import CleanOptions, MapOptions, SolveOptions
from usdface.schemas import tokens
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

SETUPS = [
    RetargetSetup(Binding(("a", "b"), np.array([3, 9]), "/Shot/Character/Head")),
    RetargetSetup(
        Binding(("a", "b", "c"), np.array([3, 3, 0]), "/Head", np.array([0.5, np.nan, 1.0])),
        peaks=(51, 7),
        neutral_weights={"jawOpen": 0.125, "mouthFrown_L": 0.062},
        curves={"jawOpen": {"mouth-open": 0.8, "chin": -0.3}, "tongueOut": {}, "a": {"b": 1.0}},
        head="markers",
        head_markers=("a", "b", "c"),
        move_head=True,
        eye_joints=("head/eyeL", "head/eyeR"),
        eye_turn=0.25,
        neutral_removed=True,
        neutral=(4, 40),
        nose_tip="a",
        roles={"lip_lower": "b", "chin": "c"},
        map=MapOptions(kernel="inverse_quadratic", form="paper", radius=2.0, smoothing=0.25),
        solve=SolveOptions(
            limits="known",
            mode="frame",
            prior="fixed",
            pace=5.0,
            smoothness=0.5,
            agility=20.0,
            spread=0.25,
            sparsity=0.1,
            symmetry=2.0,
        ),
        clean=CleanOptions(swaps=False),
    ),
    RetargetSetup(
        Binding(("a",), np.array([1]), "/Head"),
        head="stabilised",
        neutral=None,
        unsure=Binding(("b",), np.array([7]), "/Head", np.array([0.25])),
    ),
]


def written(setup: RetargetSetup) -> Usd.Prim:
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim(setup.binding.mesh, "Mesh")
    write_setup(stage, "/Retarget", setup, {tokens.BIND_MESH: [setup.binding.mesh]})
    HELD.append(stage)
    return stage.GetPrimAtPath("/Retarget")


HELD: list[Usd.Stage] = []  # prims do not keep their stage


@pytest.mark.parametrize("sure", [[0.5], [0.5, 0.5, 1.5]])
def test_confidences_that_do_not_fit_are_refused(sure: list[float]) -> None:
    prim = written(SETUPS[1])
    prim.GetAttribute(tokens.BIND_CONFIDENCE).Set(Vt.FloatArray(sure))
    with pytest.raises(InputError, match=r"</Retarget>: .*confidence"):
        read_setup(prim)


@pytest.mark.parametrize("setup", SETUPS)
def test_a_setup_survives_usd(setup: RetargetSetup) -> None:
    back = read_setup(written(setup))
    assert back.binding.markers == setup.binding.markers
    assert back.binding.mesh == setup.binding.mesh
    np.testing.assert_array_equal(back.binding.points, setup.binding.points)
    if setup.binding.confidence is None:
        assert back.binding.confidence is None
    else:
        np.testing.assert_array_equal(back.binding.confidence, setup.binding.confidence)
    assert back.unsure.markers == setup.unsure.markers
    np.testing.assert_array_equal(back.unsure.points, setup.unsure.points)
    for name in (
        "peaks",
        "head",
        "head_markers",
        "move_head",
        "neutral",
        "nose_tip",
        "curves",
        "map",
        "solve",
    ):
        assert getattr(back, name) == getattr(setup, name)
    assert dict(back.roles) == dict(setup.roles)
    assert dict(back.neutral_weights) == dict(setup.neutral_weights)


def test_no_field_of_a_setup_is_forgotten() -> None:
    """Pins and exaggeration are read at the time codes of a take, by others."""
    lost = lost_fields(lambda setup: read_setup(written(setup)))
    assert lost == {"pins", "exaggeration", "neutral_assumed"}, "usdface/io/usd/retarget_setup.py"


@pytest.mark.parametrize(
    ("names", "shapes", "factors", "message"),
    [
        (["a", "b"], ["s"], [1.0], "2 entries, usdface:curves:shapes 1"),
        (["a", "a"], ["s", "s"], [1.0, 0.5], "'a' with the shape 's' twice"),
        (["a"], [""], [0.5], "no shape for 'a', whose factor is 0.5"),
        (["a"], ["s"], [9.0], "is 9.0; expected -4 to 4"),
        (["a"], ["s"], [np.nan], "is nan; expected -4 to 4"),
    ],
)
def test_curves_that_do_not_fit_are_refused(
    names: list[str], shapes: list[str], factors: list[float], message: str
) -> None:
    prim = written(SETUPS[1])
    prim.GetAttribute(tokens.CURVES_NAMES).Set(Vt.TokenArray(names))
    prim.GetAttribute(tokens.CURVES_SHAPES).Set(Vt.TokenArray(shapes))
    prim.GetAttribute(tokens.CURVES_FACTORS).Set(Vt.FloatArray(factors))
    with pytest.raises(InputError) as raised:
        read_setup(prim)
    assert message in str(raised.value) and str(raised.value).count("</Retarget>") == 1


def test_what_is_not_authored_has_its_default() -> None:
    stage = Usd.Stage.CreateInMemory()
    back = read_setup(stage.DefinePrim("/R", tokens.RETARGET))
    assert back.neutral_removed is False  # on a stage it is named
    assert other_fields(back, PLAIN) == {"neutral_removed"}, "as usdface/schemas/schema.usda has it"


def test_a_stronger_layer_overrides_one_setting() -> None:
    prim = written(SETUPS[1])
    stage = prim.GetStage()
    stage.SetEditTarget(stage.GetSessionLayer())
    prim.GetAttribute(tokens.MAP_RADIUS).Set(7.0)
    back = read_setup(prim)
    assert back.map == MapOptions(
        kernel="inverse_quadratic", form="paper", radius=7.0, smoothing=0.25
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        (tokens.HEAD_MODE, "stabilized"),
        (tokens.NEUTRAL_MODE, "first"),
        (tokens.MAP_KERNEL, "cubic"),
        (tokens.MAP_RADIUS, float("nan")),
        (f"{tokens.SOLVE_PREFIX}spread", 0.0),
        (tokens.BIND_POINTS, Vt.IntArray([1])),
        (tokens.ROLES_NAMES, Vt.TokenArray(["x"])),
        (tokens.HEAD_MARKERS, Vt.TokenArray(["a"])),
    ],
)
def test_nonsense_names_the_prim(name: str, value: object) -> None:
    prim = written(SETUPS[1])
    prim.GetAttribute(name).Set(value)
    with pytest.raises(InputError, match="/Retarget") as caught:
        read_setup(prim)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["usdface:head:apply", "usdface:clean:swaps"])
def test_text_is_no_switch(name: str) -> None:
    """Authored by hand, without the schema's type: "false" is not true."""
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Shot/Retarget")
    prim.CreateAttribute(name, Sdf.ValueTypeNames.String).Set("false")
    with pytest.raises(InputError, match=f"</Shot/Retarget>: {name} is 'false'; expected true"):
        read_setup(prim)
