import json

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.expressions_file import expressions_json, read_expressions_file
from usdface.setup.expression import Expression


def test_what_is_written_is_read(tmp_path):
    poses = (
        Expression("contempt", ("mouthSmile_L", "ügly name"), np.array([0.7, 1.0]), 0.8),
        Expression("joy", ("a",), np.array([0.25])),
    )
    path = tmp_path / "poses.json"
    path.write_text(expressions_json(poses), encoding="utf-8")
    again = tuple(read_expressions_file(path).values())
    assert [(e.name, e.shapes, e.gain) for e in again] == [
        (e.name, e.shapes, e.gain) for e in poses
    ]
    for one, other in zip(again, poses, strict=True):
        assert (one.weights == other.weights).all()
    assert expressions_json(again) == expressions_json(poses)


def test_action_units_and_what_is_left_out(tmp_path):
    path = tmp_path / "poses.json"
    units = {"12": 0.5, "au14L": 0.9, "AU4R": 1}
    path.write_text(json.dumps({"sly": {"units": units, "gain": 0.5}, "fear": None}))
    given = read_expressions_file(path)
    assert given["fear"] is None and given["sly"].gain == 0.5
    assert {str(u): w for u, w in given["sly"].units.items()} == {
        "AU12": 0.5,
        "AU14L": 0.9,
        "AU4R": 1.0,
    }


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ("[]", "expected an object"),
        ("{}", "expected an object"),
        ("nothing", "no JSON"),
        ({"very happy": {"shapes": {"a": 1}}}, "one word"),
        ({"joy": {"a": 1}}, "'joy' is .*expected"),
        ({"joy": {"shapes": {}}}, "'joy' has no \"shapes\""),
        ({"joy": {"gain": 1}}, '\'joy\' has no "shapes" and no "units"'),
        ({"joy": {"shapes": {"a": 1}, "units": {"1": 1}}}, "or both"),
        ({"joy": {"units": {"99": 1}}}, "'99' is no action unit; expected 12, AU12 or AU12L"),
        ({"joy": {"units": {"12": 1.5}}}, r"json: expression 'joy': AU12 is 1.5"),
        ('{"joy": {"shapes": {"a": 1}}, "joy": {"shapes": {"b": 1}}}', "'joy' occurs twice"),
        ('{"joy": {"shapes": {"a": 1, "a": 0.5}}}', "'a' occurs twice"),
        ({"joy": {"units": {"12": 0.5, "AU12": 0.7}}}, "an action unit occurs twice in 12, AU12"),
        ({"bliss": None}, "'bliss' is null"),
        ({"joy": {"shapes": {"a": "1"}}}, "a is '1'"),
        ({"joy": {"shapes": {"a": True}}}, "a is True"),
        ({"joy": {"shapes": {"a": 1}, "gain": -1}}, "gain is -1"),
        ('{"joy": {"shapes": {"a": NaN}}}', "a is nan"),
        ({"joy": {"shapes": {"a": 1.5}}}, "json: expression 'joy': a is 1.5; expected 0 to 1"),
        ({"not": {"shapes": {"a": 1}}}, "'not' must be called by one word .* none of IF, IS"),
    ],
)
def test_another_form_is_refused(tmp_path, document, message):
    path = tmp_path / "poses.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(InputError, match=message):
        read_expressions_file(path)
