from itertools import product

import numpy as np
from fit_world import COLUMN, make_examples

from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.terms import linguistic_terms

EXAMPLES = make_examples(scatter=0.4)
TERMS = linguistic_terms(EXAMPLES, [EXAMPLES.rows(emotion) for emotion in EXAMPLES.names])


def columns(name):
    """Return the terms of a feature, from near to far."""
    at = np.flatnonzero(TERMS.feature == COLUMN[name])
    return sorted(at.tolist(), key=lambda i: abs(TERMS.top[i]))


def test_a_rule_subsumes_itself_and_what_asks_for_more():
    (brow, *_), (chin, *_) = columns("brow_l_y"), columns("chin_y")
    one, both = ((brow, False),), ((brow, False), (chin, False))
    assert subsumes(one, one, TERMS)
    assert subsumes(both, both[::-1], TERMS)
    assert subsumes(one, both, TERMS)
    assert not subsumes(both, one, TERMS)
    assert not subsumes(((brow, True),), one, TERMS)


def test_what_is_subsumed_fires_nowhere_further():
    """Every two rules of two conditions about three features, asked about random faces."""
    rng = np.random.default_rng(0)
    faces = rng.uniform(-0.3, 0.3, size=(4000, len(EXAMPLES.marker_features)))
    degree = TERMS.membership(faces)
    degree = np.concatenate([degree, 1 - degree], axis=1)
    names = ("brow_l_y", "chin_y", "corner_l_x")
    conditions = [(c, n) for name in names for c in columns(name) for n in (False, True)]
    rules = list(product(conditions, repeat=2))[::3]
    fired = {r: degree[:, [c + len(TERMS.names) * n for c, n in r]].min(axis=1) for r in rules}
    result = 0
    for general, special in product(rules, repeat=2):
        if subsumes(general, special, TERMS):
            result += general != special
            assert (fired[special] <= fired[general] + 1e-12).all()
    assert result > 50
