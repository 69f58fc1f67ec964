from dataclasses import replace

import pytest
from expression_systems import expression_system

from usdface.errors import InputError
from usdface.expression_system import MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable

SYSTEM = expression_system(
    (Variable("joy", "output"), Variable("lip_y", "input", (Term("up", "ramp", (0, 1)),))),
    (parse_rule("IF lip_y IS up THEN joy IS 1"),),
)


def test_outputs_are_emotions_and_inputs_have_features() -> None:
    assert SYSTEM.emotions == ("joy",)
    assert [f.name for f in SYSTEM.features] == [v.name for v in SYSTEM.fuzzy.inputs] == ["lip_y"]
    with pytest.raises(InputError, match="has 1 inputs, but 0 marker features"):
        replace(SYSTEM, features=())


@pytest.mark.parametrize(
    "settings",
    [
        {"space": "moon"},
        {"face_unit": "eye_distance"},
        {"mode": "lower"},
        {"gain": -1.0},
        {"gain": float("nan")},
        {"ease": 1.1},
        {"response": (0.4, 0.4)},
        {"response": "slow"},
    ],
)
def test_settings_are_checked(settings: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(settings)).replace("_", " ")):
        replace(SYSTEM, **settings)


@pytest.mark.parametrize("name", ["smoothing", "blend_time"])
@pytest.mark.parametrize("seconds", [-0.1, 10.1, float("nan"), float("inf")])
def test_smoothing_and_blend_time_are_of_seconds(name: str, seconds: float) -> None:
    with pytest.raises(InputError, match="expected seconds, 0 to 10"):
        replace(SYSTEM, **{name: seconds})


@pytest.mark.parametrize(
    ("feature", "says"),
    [(("",), "no role"), (("lip", "w"), "axis"), (("lip", "y", "squared"), "measure")],
)
def test_features_are_checked(feature: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        MarkerFeature(*feature)  # type: ignore[arg-type]
