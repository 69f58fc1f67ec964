from dataclasses import replace

import numpy as np
import pytest
from fit_world import COLUMN, NOISE, RULES, VARIABLES, face, make_examples, without_variants

from usdface.correction.features import smooth
from usdface.correction.rule_check import check_rules
from usdface.options import LEARNED_SMOOTHING
from usdface.rule_learning.examples import NO_EMOTION
from usdface.rule_learning.learned_system import (
    classify,
    evaluate_examples,
    evaluate_features,
    fit_system,
)


@pytest.fixture(scope="module")
def examples():
    return make_examples()


@pytest.fixture(scope="module")
def system(examples):
    return fit_system(examples).system


def rule_base(system):
    """Return what each rule asks for, without degrees, in any order."""
    found = []
    for rule in system.fuzzy.rules:
        ((emotion, value),) = rule.consequents
        assert value == 1
        motions = {f"{p.variable} {p.term.removeprefix('slightly_')}" for p in rule.propositions}
        found.append((emotion, frozenset(motions)))
    return sorted(found, key=_spelled)


def _spelled(asked):
    # The text of a set hangs on the hashes of its members, which each process makes anew.
    emotion, motions = asked
    return emotion, sorted(motions)


KNOWN = sorted(((e, frozenset(m)) for (e, _), m in RULES.items()), key=_spelled)


@pytest.mark.parametrize("seed", range(4))
def test_the_known_rule_base_is_found_again(seed):
    assert rule_base(fit_system(make_examples(seed=seed)).system) == KNOWN


def test_variants_that_nobody_named_are_found_too(examples):
    assert rule_base(fit_system(without_variants(examples)).system) == KNOWN


def test_every_example_is_heard_as_what_it_is(examples, system):
    assert classify(evaluate_examples(system, examples), system.emotions) == examples.emotions


def test_a_neutral_face_answers_exactly_nothing(system):
    assert not evaluate_features(system, VARIABLES, np.zeros((1, len(VARIABLES)))).any()
    assert not check_rules(system)


def test_jitter_at_neutral_is_not_heard(system):
    jitter = NOISE * np.random.default_rng(0).standard_normal((3000, len(VARIABLES)))
    read = smooth(jitter, np.arange(3000) / 60.0, LEARNED_SMOOTHING)
    outputs = evaluate_features(system, VARIABLES, read)
    assert outputs.mean(axis=0).max() <= 0.02
    assert outputs.max() <= 0.1


def test_the_answer_grows_with_the_intensity(system):
    """At half an expression about half is heard, and never less at more."""
    amounts = np.linspace(0, 1, 21)[:, None]
    for (emotion, _), motions in RULES.items():
        outputs = evaluate_features(system, VARIABLES, amounts * face(*motions))
        own = outputs[:, system.emotions.index(emotion)]
        assert (np.diff(own) >= -1e-12).all()
        assert np.abs(own - amounts[:, 0]).max() < 0.2
        assert (outputs[3:].argmax(axis=1) == system.emotions.index(emotion)).all()


def test_rules_are_short_and_words_are_few(system):
    assert max(len(rule.propositions) for rule in system.fuzzy.rules) <= 3
    for variable in system.fuzzy.inputs:
        signs = [np.sign(term.parameters[1]) for term in variable.terms]
        assert max(signs.count(1), signs.count(-1)) <= 3


def test_the_order_of_the_examples_does_not_matter(examples, system):
    order = np.random.default_rng(1).permutation(len(examples.emotions))
    order = sorted(order, key=lambda i: examples.names.index(examples.emotions[i])
                   if examples.emotions[i] else 99)  # fmt: skip
    mixed = replace(
        examples,
        features=examples.features[order],
        emotions=tuple(examples.emotions[i] for i in order),
        variants=tuple(examples.variants[i] for i in order),
        recordings=tuple(examples.recordings[i] for i in order),
    )
    again = fit_system(mixed).system
    assert [r.text for r in again.fuzzy.rules] == [r.text for r in system.fuzzy.rules]
    for one, other in zip(again.fuzzy.inputs, system.fuzzy.inputs, strict=True):
        for a, b in zip(one.terms, other.terms, strict=True):
            assert a.name == b.name
            assert a.parameters == pytest.approx(b.parameters, rel=1e-12)


def test_a_face_of_twice_the_size_gives_terms_of_twice_the_size(examples, system):
    twice = replace(examples, features=2 * examples.features, noise=2 * examples.noise)
    larger = fit_system(twice).system
    assert [r.text for r in larger.fuzzy.rules] == [r.text for r in system.fuzzy.rules]
    assert evaluate_examples(larger, twice) == pytest.approx(
        evaluate_examples(system, examples), abs=1e-12
    )


def test_an_intensity_that_is_given_counts(examples, system):
    """Examples at half, said to be at half, teach the whole."""
    halves = replace(
        examples,
        features=0.5 * examples.features,
        intensities=0.5 * examples.intensities,
        noise=0.5 * examples.noise,
    )
    half = fit_system(halves).system
    shown = [e != NO_EMOTION for e in examples.emotions]
    heard_whole = evaluate_examples(half, examples)[shown]
    assert heard_whole == pytest.approx(evaluate_examples(system, examples)[shown], abs=0.25)


def test_a_motion_as_small_as_the_noise_is_not_relied_on(examples):
    """The nose tells joy without fail, but by less than twice the markers' noise."""
    features = np.array(examples.features)
    features[:, COLUMN["nose_y"]] = 1.9 * NOISE * examples.rows("joy")
    system = fit_system(replace(examples, features=features)).system
    assert "nose_y" not in {v.name for v in system.fuzzy.inputs}
    features[:, COLUMN["corner_l_y"]] = 0.0
    learned = fit_system(replace(examples, features=features))
    deaf, findings = learned.system, learned.findings
    assert learned.without_rule == ("joy",)
    assert "joy" not in {rule.consequents[0][0] for rule in deaf.fuzzy.rules}
    assert [(f.code, f.where) for f in findings] == [("EXPRESSION_UNSEEN", "joy")]


@pytest.mark.parametrize(("rate", "loudest"), [(30.0, 0.2), (60.0, 0.1)])
def test_the_smallest_motion_that_counts_is_hardly_heard_in_jitter(examples, rate, loudest):
    """Joy is nothing but a nose that moves by a little more than twice the noise of a frame."""
    features = np.array(examples.features)
    features[examples.rows("joy")] = 0.0
    features[:, COLUMN["nose_y"]] = 2.2 * NOISE * examples.rows("joy")
    system = fit_system(replace(examples, features=features)).system
    assert "joy" in {rule.consequents[0][0] for rule in system.fuzzy.rules}
    jitter = NOISE * np.random.default_rng(0).standard_normal((3000, len(VARIABLES)))
    outputs = evaluate_features(
        system, VARIABLES, smooth(jitter, np.arange(3000) / rate, LEARNED_SMOOTHING)
    )
    assert outputs.mean(axis=0).max() <= 0.02
    assert outputs.max() <= loudest


def test_a_hidden_feature_is_not_used(examples, system):
    features = np.array(examples.features)
    features[5, COLUMN["corner_l_y"]] = np.nan
    assert "corner_l_y" in {v.name for v in system.fuzzy.inputs}
    blind = fit_system(replace(examples, features=features)).system
    assert "corner_l_y" not in {v.name for v in blind.fuzzy.inputs}


def test_what_a_face_does_without_meaning_it_is_kept_out():
    """Nothing among the examples forbids the brow alone; a movement does."""
    rules = {("surprise", ""): RULES["surprise", ""], ("joy", ""): RULES["joy", ""]}
    few = make_examples(rules)
    few = few.subset(np.array([e != NO_EMOTION for e in few.emotions]))
    careless = fit_system(few).system
    moves = np.array([face("brow_l_y raised"), face("chin_y lowered")])
    careful = fit_system(replace(few, movements=moves)).system
    assert evaluate_features(careless, VARIABLES, moves).max() > 0.9
    assert evaluate_features(careful, VARIABLES, moves).max() == 0


def test_faces_without_a_system_mean_nothing():
    assert classify(np.zeros((2, 0)), ()) == (NO_EMOTION, NO_EMOTION)


def test_a_learned_system_reads_features_as_its_examples_were_read(system):
    assert system.smoothing == LEARNED_SMOOTHING
