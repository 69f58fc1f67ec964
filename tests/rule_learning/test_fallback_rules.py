from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from expression_systems import changed
from fit_world import NOISE, VARIABLES, face, make_examples

from usdface.correction.features import smooth
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.options import LEARNED_SMOOTHING
from usdface.rule_learning.examples import NO_EMOTION
from usdface.rule_learning.fallback_rules import learn_fallback_rules
from usdface.rule_learning.learned_system import (
    classify,
    evaluate_examples,
    evaluate_features,
    fit_system,
)
from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.rules import learn_rules
from usdface.rule_learning.terms import linguistic_terms

# Two have three motions, of which every one alone means nothing: any two are enough to know them.
RULES = {
    ("awe", ""): ("brow_l_y raised", "chin_y lowered", "corner_l_x outward"),
    ("rage", ""): ("brow_l_y lowered", "lip_low_y raised", "corner_l_x inward"),
    ("joy", ""): ("corner_l_y raised",),
}
LEFT_OUT = [
    (emotion, tuple(m for m in motions if m != lost))
    for (emotion, _), motions in RULES.items()
    for lost in motions
    if len(motions) == 3
]


@pytest.fixture(scope="module")
def examples():
    return make_examples(RULES)


@pytest.fixture(scope="module")
def system(examples):
    return fit_system(examples).system


def without_fallback(system):
    return changed(system, rules=tuple(r for r in system.fuzzy.rules if r.weight == 1))


def learned(examples):
    groups = {e: [examples.rows(e)] for e in examples.names}
    terms = linguistic_terms(examples, [part for parts in groups.values() for part in parts])
    rules = learn_rules(examples, terms, groups)
    return terms, rules, learn_fallback_rules(examples, terms, rules)


def test_a_face_without_one_of_its_motions_is_recognised_by_fallback_rules_only(system):
    faces = np.array([face(*motions) for _, motions in LEFT_OUT])
    shown = tuple(emotion for emotion, _ in LEFT_OUT)
    assert classify(evaluate_features(system, VARIABLES, faces), system.emotions) == shown
    bare = classify(evaluate_features(without_fallback(system), VARIABLES, faces), system.emotions)
    assert bare.count(NO_EMOTION) == 4


def test_a_written_system_weighs_fallback_rules_the_same(system, tmp_path):
    for kind in ("usda", "fis", "fcl", "fll"):
        write_fuzzy_file(tmp_path / f"fallback.{kind}", system)
        again, _ = read_fuzzy_file(tmp_path / f"fallback.{kind}")
        assert [r.weight for r in again.fuzzy.rules] == [r.weight for r in system.fuzzy.rules]


@pytest.mark.parametrize("seed", range(3))
def test_a_whole_face_is_recognised_as_before(seed):
    examples = make_examples(RULES, scatter=0.3, seed=seed)
    system = fit_system(examples).system
    assert any(rule.weight < 1 for rule in system.fuzzy.rules)
    shown = np.array(examples.emotions) != NO_EMOTION
    right = np.array(examples.emotions)[shown, None] == np.array(system.emotions)
    with_fallback, bare = (
        evaluate_examples(s, examples)[shown] for s in (system, without_fallback(system))
    )
    assert with_fallback[right].mean() >= bare[right].mean() - 0.02
    assert with_fallback[~right].mean() <= bare[~right].mean() + 0.02


@pytest.mark.parametrize("seed", range(3))
def test_fallback_rules_make_no_emotion_of_what_means_none(seed):
    examples = make_examples(RULES, scatter=0.3, seed=seed)
    moves = np.array([face("brow_l_y raised", "nose_y raised"), face("lip_low_y lowered")])
    system = fit_system(replace(examples, movements=moves)).system
    none = examples.features[examples.rows(NO_EMOTION)]
    for faces, limit in ((none, 0.05), (moves, 0.2)):
        bare = evaluate_features(without_fallback(system), VARIABLES, faces)
        assert (
            evaluate_features(system, VARIABLES, faces) <= np.maximum(bare, limit) + 1e-12
        ).all()


def test_a_neutral_face_gives_no_fallback_rule(system):
    assert not evaluate_features(system, VARIABLES, np.zeros((1, len(VARIABLES)))).any()
    jitter = NOISE * np.random.default_rng(0).standard_normal((3000, len(VARIABLES)))
    read = smooth(jitter, np.arange(3000) / 60.0, LEARNED_SMOOTHING)
    outputs = evaluate_features(system, VARIABLES, read)
    assert outputs.mean(axis=0).max() <= 0.02
    assert outputs.max() <= 0.1


@pytest.mark.parametrize("seed", range(3))
def test_fallback_rules_are_few_and_short_and_each_says_something_new(seed):
    terms, rules, fallback = learned(make_examples(RULES, scatter=0.3, seed=seed))
    for emotion, _ in RULES:
        own = [rule for rule in fallback if rule.emotion == emotion]
        assert len(own) <= 3
        assert all(len(rule.conditions) <= 2 and rule.fallback for rule in own)
        assert not any(rule.conditions[0][1] for rule in own)
        known = [rule for rule in rules if rule.emotion == emotion]
        pairs = [*product(known, own), *permutations(own, 2)]
        assert not any(subsumes(a.conditions, b.conditions, terms) for a, b in pairs)


def test_without_a_motion_there_is_no_fallback_rule():
    examples = make_examples(RULES)
    still = replace(examples, features=np.zeros(examples.features.shape))
    assert learned(still)[2] == []
