import json

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.expressions_file import expressions_json, read_expressions_file
from usdface.setup import Expression


def test_what_is_written_is_read(tmp_path):
    poses = (
        Expression("contempt", ("mouthSmile_L", "ügly name"), np.array([0.7, 1.0]), 0.8),
        Expression("joy", ("a",), np.array([0.25])),
    )
    path = tmp_path / "poses.json"
    path.write_text(expressions_json(poses), encoding="utf-8")
    again = read_expressions_file(path)
    assert [(e.name, e.shapes, e.gain) for e in again] == [
        (e.name, e.shapes, e.gain) for e in poses
    ]
    for one, other in zip(again, poses, strict=True):
        assert (one.weights == other.weights).all()
    assert expressions_json(again) == expressions_json(poses)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ("[]", "expected an object"),
        ("{}", "expected an object"),
        ("nothing", "no JSON"),
        ({"very happy": {"shapes": {"a": 1}}}, "one word"),
        ({"joy": {"a": 1}}, "'joy' is .*expected"),
        ({"joy": {"shapes": {}}}, "'joy' has no \"shapes\""),
        ({"joy": {"shapes": {"a": "1"}}}, "a is '1'"),
        ({"joy": {"shapes": {"a": True}}}, "a is True"),
        ({"joy": {"shapes": {"a": 1}, "gain": -1}}, "gain is -1"),
        ('{"joy": {"shapes": {"a": NaN}}}', "a is nan"),
        ({"joy": {"shapes": {"a": 1.5}}}, "in .0, 1."),
    ],
)
def test_another_form_is_refused(tmp_path, document, said):
    path = tmp_path / "poses.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(InputError, match=said):
        read_expressions_file(path)
