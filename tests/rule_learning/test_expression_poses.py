from dataclasses import replace

import numpy as np
import pytest
from fit_world import make_examples

from usdface.rule_learning.expression_poses import learned_poses

SHAPES = ("brow", "jaw", "smile")
SHOWN = {
    ("joy", ""): [0.0, 0.0, 0.8],
    ("surprise", ""): [0.9, 0.6, 0.0],
    ("fear", ""): [0.7, 0.02, 0.3],
    ("anger", "open"): [0.8, 0.7, 0.0],
    ("anger", "closed"): [0.6, 0.0, 0.0],
    ("contempt", ""): [0.0, 0.0, 0.4],
}


def weights_of(examples):
    pairs = zip(examples.emotions, examples.variants, strict=True)
    return np.array([SHOWN.get(pair, [0.0, 0.0, 0.0]) for pair in pairs])


def poses(examples, scale=1.0):
    found = learned_poses(examples, scale * weights_of(examples), SHAPES)
    return {pose.name: dict(zip(pose.shapes, pose.weights.tolist(), strict=True)) for pose in found}


def test_a_pose_is_what_every_variant_shows():
    found = poses(make_examples())
    assert found["anger"] == {"brow": 0.6}
    assert found["surprise"] == {"brow": 0.9, "jaw": 0.6}


def test_what_a_solve_leaves_on_any_face_is_no_part_of_a_pose():
    assert "jaw" not in poses(make_examples())["fear"]


def test_half_shown_and_said_to_be_half_is_whole():
    examples = make_examples()
    halves = replace(examples, intensities=0.5 * examples.intensities)
    for name, pose in poses(halves, 0.5).items():
        assert pose == pytest.approx(poses(examples)[name])
    beyond = poses(halves)
    assert beyond["joy"] == {"smile": 1.0}
