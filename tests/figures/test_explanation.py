from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from expression_systems import changed, expression_system

from usdface.correction.expression_layer import ExpressionTrace, SideTrace
from usdface.errors import InputError
from usdface.figures.explanation import write_explanation_figure
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.rigs import Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.explanation import Explanation
from usdface.shot.shot import Shot, ShotResult
from usdface.takes import WeightsTake

PNG = b"\x89PNG\r\n\x1a\n"


def explanation(
    frames: int = 9, correction: float = 0.3, rule: str = "IF lip_y IS raised THEN joy IS 1"
) -> Explanation:
    term = Term("raised", "ramp", (0.0, 1.0))
    variables = (Variable("lip_y", "input", terms=(term,)), Variable("joy", "output"))
    system = expression_system(variables, (parse_rule(rule),) if rule else ())
    rise = np.linspace(0, 1, frames)[:, None]
    inputs = rise.copy()
    inputs[0] = np.nan  # occluded
    evaluation = evaluate(system.fuzzy, inputs, memberships=True)
    whole = SideTrace(inputs, evaluation, rise, {}, evaluation.outputs)
    trace = ExpressionTrace(system, ("lip",), 0.05, np.array([[1.0, 0.0]]), {"both": whole})
    solved = WeightsTake(
        ("a", "b"), np.arange(frames) / 30, 0.5 * rise @ np.ones((1, 2)), rate=30.0
    )
    setup = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), nose_tip="nose")
    shot = Shot(Rig("face", ()), solved, setup)
    return Explanation(ShotResult(shot, solved, solved.weights + correction, trace=trace), trace)


def with_sides(explained: Explanation, **sides: SideTrace) -> Explanation:
    return replace(explained, trace=replace(explained.trace, sides=sides))


@pytest.mark.slow
@pytest.mark.parametrize(
    "suffix", [".png", *(pytest.param(name, marks=pytest.mark.slow) for name in (".svg", ".pdf"))]
)
def test_a_figure_is_drawn_and_repeats(tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        write_explanation_figure(explanation(), 4, tmp_path / f"{name}{suffix}")
    first = (tmp_path / f"one{suffix}").read_bytes()
    assert len(first) > 5000
    if suffix == ".png":
        assert first.startswith(PNG)
        assert first == (tmp_path / f"two{suffix}").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    "explained",
    [
        explanation(1),
        pytest.param(explanation(correction=0.0), marks=pytest.mark.slow),
        pytest.param(explanation(rule=""), marks=pytest.mark.slow),
        replace(explanation(), trace=replace(explanation().trace, poses=np.zeros((1, 2)))),
    ],
    ids=["one frame", "no correction", "no rules", "no pose"],
)
def test_little_to_show_is_shown(tmp_path: Path, explained: Explanation) -> None:
    write_explanation_figure(explained, 0, tmp_path / "out.png")
    assert (tmp_path / "out.png").read_bytes().startswith(PNG)


@pytest.mark.slow
def test_what_a_rule_denies_is_drawn_as_it_asks_for_it(tmp_path: Path) -> None:
    explained = explanation()
    other = explanation(rule="IF lip_y IS NOT raised THEN joy IS 1")
    for case, name in ((explained, "raised"), (other, "not raised")):
        write_explanation_figure(case, 4, tmp_path / "out.svg")
        text = (tmp_path / "out.svg").read_text()
        assert f"<!-- {name} -->" in text
        assert ("<!-- not raised -->" in text) == (case is other)


@pytest.mark.slow
def test_a_half_that_says_something_else_has_its_curve(tmp_path: Path) -> None:
    explained = explanation()
    whole = explained.whole
    silent = replace(whole.evaluation, outputs=0.0 * whole.evaluation.outputs)
    still = replace(whole, evaluation=silent, intensity=0.0 * whole.intensity)
    halves = with_sides(explained, both=still, left=whole, right=still)
    write_explanation_figure(halves, 4, tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    assert "<!-- joy, left half -->" in text and "<!-- joy, right half -->" not in text
    assert "no emotion; left half: joy 0.50 -->" in text


@pytest.mark.slow
def test_of_thousands_of_rules_those_that_fire_most_have_a_row(tmp_path: Path) -> None:
    explained = explanation()
    rules, loud = explained.system.fuzzy.rules * 3000, 2017
    firing = np.zeros((len(explained.times), len(rules)))
    firing[:, loud] = 0.7
    evaluation = replace(explained.whole.evaluation, firing=firing)
    many = with_sides(explained, both=replace(explained.whole, evaluation=evaluation))
    system = changed(explained.system, rules=rules)
    many = replace(many, trace=replace(many.trace, system=system))
    write_explanation_figure(many, 4, tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    assert text.count("<!-- joy: lip_y raised -->") == 60
    assert "(the 60 of 3000 that fire most)" in text


def test_a_name_that_is_no_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png"):
        write_explanation_figure(explanation(), 0, tmp_path / "out.usda")
    assert not list(tmp_path.iterdir())
