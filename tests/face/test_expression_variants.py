"""Variants of expressions: FACS's, on rigs whose blend shapes have known names."""

import numpy as np
from face.test_expression_poses import RIGS

from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import EMOTIONS, expressions_for
from usdface.face.expression_variants import VARIANTS, expression_variants
from usdface.retarget_setup import Expression


def test_every_emotion_has_variants_and_none_is_listed_twice():
    listed = [units for each in VARIANTS.values() for units in each]
    assert set(VARIANTS) == set(EMOTIONS)
    assert len(listed) == len(set(listed))


def test_poses_come_first_then_their_variants_at_several_strengths():
    shapes = RIGS["arkit"]
    expressions, _ = expressions_for(shapes)
    found = expression_variants(expressions, shapes, drawn=())
    assert [(v.emotion, v.source) for v in found[:6]] == [(e.name, "pose") for e in expressions]
    assert {v.source for v in found[6:]} == {"FACS"}
    smiles = [v.weights[shapes.index("mouthSmileLeft")] for v in found if v.emotion == "joy"]
    np.testing.assert_allclose(smiles[1:4], [0.8, 0.9, 0.5])


def test_every_drawn_expression_is_shown_by_a_rig_that_has_its_units():
    shapes = RIGS["arkit"]
    expressions, _ = expressions_for(shapes)
    for source, drawn in DRAWN.items():
        found = [
            v for v in expression_variants(expressions, shapes, (source,)) if v.source == source
        ]
        assert sorted(v.emotion for v in found) == sorted(emotion for emotion, _ in drawn)


def test_other_expressions_and_rigs_have_their_poses_alone():
    sly = Expression("sly", ("mouthSmileLeft",), np.ones(1))
    assert len(expression_variants([sly], RIGS["arkit"])) == 1
    joy = Expression("joy", ("a",), np.ones(1))
    assert len(expression_variants([joy], ("a", "b"))) == 1
