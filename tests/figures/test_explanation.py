from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from expression_systems import changed, expression_system

from usdface.errors import InputError
from usdface.explanation import Explanation, Heard
from usdface.figures.explanation import write_explanation_figure
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.variables import Term, Variable

PNG = b"\x89PNG\r\n\x1a\n"


def explanation(frames: int = 9, correction: float = 0.3) -> Explanation:
    term = Term("raised", "ramp", (0.0, 1.0))
    system = expression_system(
        (Variable("lip_y", "input", terms=(term,)), Variable("joy", "output")),
        (parse_rule("IF lip_y IS raised THEN joy IS 1"),),
    )
    rise = np.linspace(0, 1, frames)[:, None]
    solved = 0.5 * rise @ np.ones((1, 2))
    inputs = rise.copy()
    inputs[0] = np.nan  # occluded
    return Explanation(
        system,
        np.arange(frames) / 30,
        inputs,
        rise,
        rise,
        ("a", "b"),
        solved,
        solved + correction,
        ("lip",),
        "nose",
        0.05,
        np.array([[1.0, 0.0]]),
        rise,
    )


def no_rules(explained: Explanation) -> Explanation:
    system = changed(explained.system, rules=())
    return replace(explained, system=system, firing=np.zeros((len(explained.times), 0)))


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_figure_is_drawn_and_repeats(tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        write_explanation_figure(explanation(), 4, tmp_path / f"{name}{suffix}")
    first = (tmp_path / f"one{suffix}").read_bytes()
    assert len(first) > 5000
    if suffix == ".png":
        assert first.startswith(PNG)
        assert first == (tmp_path / f"two{suffix}").read_bytes()


@pytest.mark.parametrize(
    "explained",
    [
        explanation(1),
        explanation(correction=0.0),
        no_rules(explanation()),
        replace(explanation(), poses=np.zeros((1, 2))),
    ],
    ids=["one frame", "no correction", "no rules", "no pose"],
)
def test_little_to_show_is_shown(tmp_path: Path, explained: Explanation) -> None:
    write_explanation_figure(explained, 0, tmp_path / "out.png")
    assert (tmp_path / "out.png").read_bytes().startswith(PNG)


def test_what_a_rule_denies_is_drawn_as_it_asks_for_it(tmp_path: Path) -> None:
    explained = explanation()
    denied = parse_rule("IF lip_y IS NOT raised THEN joy IS 1")
    other = replace(
        explained,
        system=changed(explained.system, rules=(denied,)),
        firing=1.0 - explained.firing,
    )
    for case, name in ((explained, "raised"), (other, "not raised")):
        write_explanation_figure(case, 4, tmp_path / "out.svg")
        said = (tmp_path / "out.svg").read_text()
        assert f"<!-- {name} -->" in said
        assert ("<!-- not raised -->" in said) == (case is other)


def test_a_half_that_says_something_else_has_its_curve(tmp_path: Path) -> None:
    whole = explanation()
    still = replace(whole, outputs=0.0 * whole.outputs, shown=0.0 * whole.shown)
    sides = {"left": whole, "right": still}
    halves = {s: Heard(e.inputs, e.firing, e.outputs, e.shown) for s, e in sides.items()}
    write_explanation_figure(replace(still, halves=halves), 4, tmp_path / "a.svg")
    said = (tmp_path / "a.svg").read_text()
    assert "<!-- joy, left half -->" in said and "<!-- joy, right half -->" not in said
    assert "no emotion; left half: joy 0.50 -->" in said


def test_of_thousands_of_rules_those_that_fire_most_have_a_row(tmp_path: Path) -> None:
    explained = explanation()
    rules, loud = explained.system.fuzzy.rules * 3000, 2017
    firing = np.zeros((len(explained.times), len(rules)))
    firing[:, loud] = 0.7
    system = changed(explained.system, rules=rules)
    write_explanation_figure(
        replace(explained, system=system, firing=firing), 4, tmp_path / "a.svg"
    )
    said = (tmp_path / "a.svg").read_text()
    assert said.count("<!-- joy: lip_y raised -->") == 60
    assert "(the 60 of 3000 that fire most)" in said


def test_a_name_that_is_no_picture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png"):
        write_explanation_figure(explanation(), 0, tmp_path / "out.usda")
    assert not list(tmp_path.iterdir())
