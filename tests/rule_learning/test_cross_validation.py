from dataclasses import replace

import numpy as np
import pytest
from fit_world import RULES, make_examples

from usdface.rule_learning.cross_validation import cross_validate, folds, held_out


@pytest.fixture(scope="module")
def examples():
    return make_examples()


def test_every_example_is_left_out_once(examples):
    out = np.array(list(folds(examples, "recording")))
    assert len(out) == 4
    assert (out.sum(axis=0) == 1).all()


def test_left_out_recordings_are_heard_right(examples):
    found = cross_validate(examples, "recording")
    assert found.tested == len(examples.emotions)
    assert found.right == found.tested > 0
    assert (found.counts == np.diag(np.diag(found.counts))).all()
    assert all(found.margins_of(name).min() > 0.5 for name in examples.names)
    assert found.findings() == []


@pytest.mark.slow
def test_labels_without_meaning_are_not_heard(examples):
    """Shuffled labels: a validation that looked at what it tests would still find them."""
    order = np.random.default_rng(2).permutation(len(examples.emotions))
    mixed = replace(
        examples,
        emotions=tuple(examples.emotions[i] for i in order),
        variants=tuple(examples.variants[i] for i in order),
    )
    found = cross_validate(mixed, "recording")
    shown = found.counts[:-1]
    assert np.trace(shown) < 0.3 * shown.sum()


@pytest.mark.slow
def test_an_emotion_of_one_recording_cannot_be_tested(examples):
    takes = tuple(
        "alone" if emotion == "joy" else take
        for emotion, take in zip(examples.emotions, examples.recordings, strict=True)
    )
    found = cross_validate(replace(examples, recordings=takes), "recording")
    assert found.untested == ("joy",)
    assert [(f.code, f.where) for f in found.findings()] == [("FIT_UNTESTED", "joy")]
    assert np.isnan(found.margins[examples.rows("joy")]).all()


@pytest.mark.slow
def test_two_variants_with_nothing_in_common_do_not_teach_each_other(examples):
    found = cross_validate(examples, "variant")
    assert found.tested == examples.rows("anger").sum()
    assert found.right < found.tested
    assert "FIT_UNTESTED" in {f.code for f in found.findings()}


def test_what_is_left_out_is_what_there_are_several_of(examples):
    assert held_out(examples) == "recording"
    one = replace(examples, recordings=("a",) * len(examples.emotions))
    assert held_out(one) == "none"
    halves = tuple(str(i % 2) for i in range(len(examples.emotions)))
    assert held_out(replace(one, variants=halves)) == "variant"
    assert list(folds(one, "none")) == []
    nothing = cross_validate(one, "none")
    assert nothing.tested == 0


@pytest.mark.slow
def test_what_looks_alike_is_said_to_be_confused():
    twins = {**RULES, ("awe", ""): RULES["surprise", ""]}
    found = cross_validate(make_examples(twins), "recording")
    confused = {f.where for f in found.findings() if f.code == "FIT_CONFUSED"}
    assert confused & {"awe", "surprise"}
    assert confused <= {"awe", "surprise"}


def test_another_way_of_hearing_can_be_compared(examples):
    def deaf(kept, left):
        return np.zeros((len(left.emotions), len(kept.names))), kept.names

    found = cross_validate(examples, "recording", deaf)
    assert found.counts[:, :-1].sum() == 0
    table = found.as_dict()["confusion"]
    assert table["joy"]["none"] == 8
