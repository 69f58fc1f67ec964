from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from fit_world import NOISE, RULES, face, make_examples

from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.rules import choose_groupings, learn_rules
from usdface.rule_learning.terms import linguistic_terms
from usdface.rule_learning.variants import variant_groupings


def learned(examples):
    """Return (emotion, conditions as text) of each rule."""
    ways = variant_groupings(examples)
    groups = [part for way in ways.values() for parts in way for part in parts]
    parts = choose_groupings(examples, linguistic_terms(examples, groups), ways)
    terms = linguistic_terms(examples, [part for way in parts.values() for part in way])
    names = [examples.marker_features[i].name for i in terms.feature]
    return [
        (
            rule.emotion,
            [f"{names[t]} {'NOT ' * n}{terms.names[t]}" for t, n in rule.conditions],
        )
        for rule in learn_rules(examples, terms, parts)
    ]


def test_a_condition_is_negated_where_only_that_tells_apart():
    """Calm is a raised brow without the chin, surprise with it."""
    rules = {
        ("calm", ""): {"brow_l_y raised"},
        ("surprise", ""): {"brow_l_y raised", "chin_y lowered"},
    }
    examples = make_examples(rules)
    examples = examples.subset(np.array([bool(e) for e in examples.emotions]))
    found = dict(learned(examples))
    assert found["calm"] == ["brow_l_y raised", "chin_y NOT lowered"]
    assert "chin_y lowered" in found["surprise"]


def test_the_first_condition_is_never_negated():
    for seed in range(3):
        for _, conditions in learned(make_examples(seed=seed)):
            assert "NOT" not in conditions[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_every_condition_asks_another_marker(seed):
    rng = np.random.default_rng(seed)
    examples = make_examples(seed=seed)
    mixed = examples.features + 0.03 * rng.standard_normal((len(examples.emotions), 1))
    for _, conditions in learned(replace(examples, features=mixed)):
        markers = [c.split()[0].rsplit("_", 1)[0] for c in conditions]
        assert len(set(markers)) == len(markers) <= 3


@pytest.mark.parametrize("seed", range(4))
def test_no_rule_stands_twice_nor_under_another(seed):
    """Examples that scatter leave a rule's variant uncovered: it was found again then."""
    examples = make_examples(scatter=0.3, seed=seed)
    parts = {emotion: ways[0] for emotion, ways in variant_groupings(examples).items()}
    terms = linguistic_terms(examples, [part for way in parts.values() for part in way])
    rules = learn_rules(examples, terms, parts)
    for one, other in permutations(rules, 2):
        same = one.emotion == other.emotion
        assert not (same and subsumes(one.conditions, other.conditions, terms))


def test_two_names_for_the_same_get_no_rule():
    """Firing on the other as much as on its own costs more than silence."""
    twins = {**RULES, ("awe", ""): RULES["surprise", ""]}
    result = {emotion for emotion, _ in learned(make_examples(twins))}
    assert result == {"joy", "fear", "anger", "contempt"}


def test_a_movement_that_is_the_expression_is_not_held_against_it():
    """The rig has one blend shape that is the whole smile."""
    examples = make_examples()
    smile = np.array([face("corner_l_y raised")])
    found = dict(learned(replace(examples, movements=smile)))
    assert found["joy"] == ["corner_l_y raised"]


def test_a_quiet_marker_goes_before_a_noisy_one():
    """Two markers tell joy alike; one of them shakes three times as much."""
    examples = make_examples()
    features = np.array(examples.features)
    twin, corner = 7, 10  # cheek_l_y does as corner_l_y
    features[:, twin] = features[:, corner]
    noise = np.full(18, NOISE)
    for shaky, steady in ((twin, "corner_l_y"), (corner, "cheek_l_y")):
        noise[[twin, corner]] = NOISE
        noise[shaky] = 3 * NOISE
        rules = {("joy", ""): RULES["joy", ""], ("surprise", ""): RULES["surprise", ""]}
        kept = np.isin(examples.emotions, [e for e, _ in rules])
        named = replace(examples, features=features, noise=noise.copy()).subset(kept)
        assert dict(learned(named))["joy"][0].startswith(steady)
