from dataclasses import replace

import numpy as np
from fit_world import RULES, make_examples, without_variants

from usdface.rule_learning.variants import variant_groupings


def test_named_variants_are_the_parts():
    examples = make_examples()
    ways = variant_groupings(examples)
    (parts,) = ways["anger"]
    assert [p.tolist() for p in parts] == [
        examples.rows("anger", v).tolist() for v in ("closed", "open")
    ]


def test_examples_that_lie_together_are_found_to_be_the_variants():
    examples = make_examples()
    one, two, three = variant_groupings(without_variants(examples))["anger"]
    assert [len(way) for way in (one, two, three)] == [1, 2, 3]
    assert (one[0] == examples.rows("anger")).all()
    found = {tuple(np.flatnonzero(part)) for part in two}
    assert found == {tuple(np.flatnonzero(examples.rows("anger", v))) for v in ("open", "closed")}


def test_every_parting_holds_each_example_once():
    for emotion, ways in variant_groupings(without_variants(make_examples())).items():
        for parts in ways:
            own = make_examples().rows(emotion)
            assert (np.sum(parts, axis=0) == own).all()


def test_one_example_is_not_parted():
    few = make_examples(RULES, takes=1)
    first = few.rows("joy") & (np.cumsum(few.rows("joy")) == 1)
    alone = few.subset(first)
    assert [len(parts) for parts in variant_groupings(alone)["joy"]] == [1]
    hidden = np.array(few.features)
    hidden[0, 0] = np.nan
    assert len(variant_groupings(replace(few, features=hidden))["joy"]) == 2
