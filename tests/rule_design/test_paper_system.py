from dataclasses import replace

import numpy as np
import pytest

from usdface.correction.features import measure
from usdface.correction.rule_check import fires_at_neutral
from usdface.fuzzy.inference import evaluate
from usdface.papers import fuzzy_table
from usdface.rule_design.paper_system import EMOTIONS, MEDIUM, RULES, paper_system, published_cases

NEUTRAL = np.zeros((1, 13))


def test_the_published_outputs_are_met():
    table = fuzzy_table()
    assert np.isfinite(table.published).sum() == 33
    assert table.rms < 0.009
    assert table.largest < 0.041


def test_the_largest_residual_is_surprise_in_the_fear_pose():
    table = fuzzy_table()
    row, column = np.unravel_index(np.nanargmax(np.abs(table.computed - table.published)), (6, 6))
    assert (table.rows[row], table.columns[column]) == ("fear", "surprise")


def test_own_rules_only_does_not_reproduce_the_paper():
    assert fuzzy_table(replace(paper_system().fuzzy, normalisation="per_output")).rms > 0.2


def test_product_as_and_is_of_the_same_quality():
    assert fuzzy_table(replace(paper_system().fuzzy, and_="prod")).rms < 0.012


def test_the_paper_calls_a_neutral_face_angry():
    system = paper_system()
    answer = dict(zip(EMOTIONS, evaluate(system.fuzzy, NEUTRAL).outputs[0], strict=True))
    assert answer == {**dict.fromkeys(EMOTIONS, 0.0), "anger": 1.0}
    assert [rule.text for rule in fires_at_neutral(system)] == [RULES[4]]


def test_at_5_percent_every_expression_is_anger():
    outputs = evaluate(paper_system().fuzzy, 0.05 * published_cases().inputs).outputs
    assert (outputs.argmax(axis=1) == EMOTIONS.index("anger")).all()
    assert outputs[:, EMOTIONS.index("anger")].min() > 0.9


@pytest.mark.parametrize("name", [n for n in MEDIUM if not n.endswith("l_eyebrow_end_x")])
def test_terms_follow_the_design_rule(name):
    inputs = published_cases().inputs
    column = inputs[:, list(MEDIUM).index(name)]
    variable = next(v for v in paper_system().fuzzy.inputs if v.name == name)
    low, medium, high = (variable.term(t).parameters for t in ("low", "medium", "high"))
    assert low[1] == medium[0] == column.min()
    assert high[1] == medium[2] == column.max()
    assert medium[1] == low[2] == high[0] == MEDIUM[name]


def test_it_reads_markers_as_the_paper_does():
    system = paper_system()
    roles = sorted({f.role for f in system.features})
    names = ("nose", *roles)
    rng = np.random.default_rng(2)
    neutral = rng.normal(size=(len(names), 3))
    moved = neutral + 0.001 * rng.normal(size=neutral.shape)
    values = measure(moved[None], neutral, names, system.features, {}, "nose", 0.001)
    offset = np.abs(moved - moved[0]) - np.abs(neutral - neutral[0])
    expected = [
        abs(offset[names.index(f.role), "xyz".index(f.axis)]) / 0.001 for f in system.features
    ]
    np.testing.assert_allclose(values[0], expected)
