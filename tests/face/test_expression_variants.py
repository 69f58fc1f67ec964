"""Variants of expressions: drawn ones, on rigs whose blend shapes have known names."""

import numpy as np
from face.test_expression_poses import RIGS

from usdface.face.drawn_expressions import DRAWN
from usdface.face.expression_poses import expressions_for
from usdface.face.expression_variants import expression_variants
from usdface.setup.expression import Expression


def test_poses_come_first_then_what_is_drawn():
    shapes = RIGS["arkit"]
    expressions, _ = expressions_for(shapes)
    found = expression_variants(expressions, shapes)
    assert [(v.emotion, v.source) for v in found[:6]] == [(e.name, "pose") for e in expressions]
    assert {v.source for v in found[6:]} == set(DRAWN)
    assert len(expression_variants(expressions, shapes, drawn=())) == 6


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
