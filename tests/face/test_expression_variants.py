"""Variants of expressions: FACS's, on rigs whose blend shapes have known names."""

import numpy as np
from face.test_expression_poses import RIGS

from usdface.face.expression_poses import EMOTIONS, expressions_for
from usdface.face.expression_variants import AMBIGUOUS, VARIANTS, expression_variants
from usdface.retarget_setup import Expression


def test_every_emotion_has_variants_and_none_is_listed_twice():
    listed = [units for table in (VARIANTS, AMBIGUOUS) for each in table.values() for units in each]
    assert set(VARIANTS) == set(AMBIGUOUS) == set(EMOTIONS)
    assert len(listed) == len(set(listed))


def test_poses_come_first_then_their_variants_at_several_strengths():
    shapes = RIGS["arkit"]
    expressions, _ = expressions_for(shapes)
    found = expression_variants(expressions, shapes)
    assert [v.emotion for v in found[:6]] == [e.name for e in expressions]
    assert all(not v.units and v.heard for v in found[:6])
    smiles = [v.weights[shapes.index("mouthSmileLeft")] for v in found if v.units == (6, 12)]
    np.testing.assert_allclose(smiles, [0.8, 0.9, 0.5])
    assert not any(v.heard for v in found if v.units in AMBIGUOUS["anger"])


def test_other_expressions_and_rigs_have_their_poses_alone():
    sly = Expression("sly", ("mouthSmileLeft",), np.ones(1))
    assert len(expression_variants([sly], RIGS["arkit"])) == 1
    joy = Expression("joy", ("a",), np.ones(1))
    assert len(expression_variants([joy], ("a", "b"))) == 1
