from dataclasses import replace

import numpy as np
import pytest
from slits import EXPRESSIONS, slit_face

from usdface.face.antagonists import antagonists
from usdface.rigs import BlendShape
from usdface.setup.expression import Expression

FACE = slit_face()


def test_what_lifts_and_what_lowers_the_same_skin_are_antagonists_on_their_own_side():
    pairs = {frozenset(pair) for pair in antagonists(FACE, EXPRESSIONS)}
    for side, other in (("Left", "Right"), ("Right", "Left")):
        assert frozenset((f"mouthSmile{side}", f"mouthFrown{side}")) in pairs
        assert frozenset((f"mouthUpperUp{side}", f"mouthFrown{side}")) in pairs
        assert frozenset((f"mouthSmile{side}", f"mouthFrown{other}")) not in pairs
    assert not any("eyeBlinkLeft" in pair for pair in pairs)  # no expression raises it


def test_shapes_that_an_expression_shows_together_are_none():
    together = Expression("wry", ("mouthSmileLeft", "mouthFrownLeft"), np.ones(2))
    pairs = antagonists(FACE, (*EXPRESSIONS, together))
    assert ("mouthSmileLeft", "mouthFrownLeft") not in pairs
    assert ("mouthSmileRight", "mouthFrownRight") in pairs


def test_the_corners_of_the_mouth_are_known_by_name_where_the_fields_hardly_oppose():
    by_name = {shape.name: shape for shape in FACE.shapes}
    smile, frown = by_name["mouthSmileLeft"], by_name["mouthFrownLeft"]
    outward = smile.offsets * [1, 0, 0] + [0, 0.0006, 0]
    weak = BlendShape("mouthSmileLeft", smile.indices, outward)
    lowered = Expression("b", ("mouthFrownLeft",), np.ones(1))
    used = Expression("a", ("mouthSmileLeft",), np.ones(1)), lowered
    assert antagonists(replace(FACE, shapes=(weak, frown)), used) == (
        ("mouthSmileLeft", "mouthFrownLeft"),
    )
    other = BlendShape("m1", smile.indices, outward)
    used = Expression("a", ("m1",), np.ones(1)), lowered
    assert antagonists(replace(FACE, shapes=(other, frown)), used) == ()


@pytest.mark.parametrize("scale", [1e-25, 1e25])
def test_offsets_of_any_size_have_a_direction(scale):
    shapes = tuple(replace(shape, offsets=scale * shape.offsets) for shape in FACE.shapes)
    assert antagonists(replace(FACE, shapes=shapes), EXPRESSIONS) == antagonists(FACE, EXPRESSIONS)
