"""Selection: strong features of both sides, most of which no rival shows."""

import numpy as np
import pytest

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.rule_design.face_motions import FaceMotions
from usdface.rule_design.feature_errors import feature_errors
from usdface.rule_design.feature_selection import SelectedFeatures, select_features
from usdface.rule_design.movements import Movements
from usdface.rule_design.selection_cost import group_firing

NOISE = 0.0001


def features(*moves, markers=4):
    """One row per shape; a move is {feature: metres}."""
    rows = np.zeros((len(moves), 3 * markers))
    for row, move in zip(rows, moves, strict=True):
        row[list(move)] = list(move.values())
    return rows


def selected(
    index, poses, basis, *, whole=(), mixed=(), noise=NOISE, upper=(), twins=(), apart=False
) -> SelectedFeatures:
    """Movements are those given; markers `upper` are above the nose tip."""
    count = basis.shape[1]
    rows = {k: np.reshape(v, (-1, len(basis))) for k, v in (("whole", whole), ("mixed", mixed))}
    twin = np.arange(count)
    for a, b in twins:
        twin[[a, b]] = b, a
    evaluator, poses = BlendShapeEvaluator(basis), np.asarray(poses, dtype=float)
    jitter = np.full(count, noise) if np.isscalar(noise) else noise
    movements = Movements(rows["whole"], rows["whole"], rows["mixed"])
    above = np.isin(np.arange(count) // 3, list(upper))
    motions = FaceMotions(evaluator, above, twin, poses, movements)
    own = motions.features(poses[index : index + 1])[0]
    errors = feature_errors(own, jitter, np.zeros(count))
    return select_features(index, motions, errors, apart=apart)


def test_a_feature_comes_with_that_of_the_other_side():
    basis = features({1: 0.01, 4: 0.01, 7: 0.005})
    found = selected(0, np.eye(1), basis, twins=[(1, 4)])
    assert found.ramps.keys() == {1, 4, 7}
    assert any({1, 4} <= set(group) for group in found.groups)


def test_one_side_alone_is_read_alone():
    basis = features({1: 0.01, 4: 0.002})
    assert selected(0, np.eye(1), basis, twins=[(1, 4)]).ramps.keys() >= {1}


def test_the_features_that_tell_apart_go_before_those_that_move_most():
    # 1 and 4 move in both poses, 7 to 10 in the first.
    basis = features({1: 0.02, 4: 0.02, 6: 0.008, 7: 0.008, 8: 0.008, 9: 0.008, 10: 0.008}, {})
    basis[1, [1, 4]] = 0.02
    found = selected(0, np.eye(2), basis)
    assert len({6, 7, 8, 9, 10} & found.ramps.keys()) > len({1, 4} & found.ramps.keys())
    ramps = found.ramps
    other = [np.clip((basis[1, f] - a) / (b - a), 0, 1).reshape(1) for f, (a, b) in ramps.items()]
    assert group_firing(other)[0] < 0.1
    assert not found.confused and not found.negative


def test_signs_are_kept_and_the_dead_zone_lies_between():
    foot, top = selected(0, np.eye(1), features({1: -0.01})).ramps[1]
    assert top == pytest.approx(-0.0094)
    assert top < foot < 0


def test_what_hides_in_the_noise_is_not_chosen():
    basis = features({1: 0.01, 4: 0.004})
    assert selected(0, np.eye(1), basis, noise=0.0012).ramps.keys() == {1}
    assert selected(0, np.eye(1), basis, noise=0.005) == SelectedFeatures({})


def test_one_pose_within_another_excludes_what_the_other_does_besides():
    basis = features({1: 0.01}, {4: 0.01})
    part, whole = (selected(i, [[1, 0], [1, 1]], basis) for i in (0, 1))
    assert part.ramps.keys() == {1} and [i for each in part.negative for i, _ in each] == [4]
    assert 4 in whole.ramps and not part.confused and not whole.confused


def test_poses_that_differ_in_what_no_marker_sees_are_confused():
    basis = features({1: 0.01}, {})
    poses = [[1.0, 0.0], [1.0, 1.0]]
    assert selected(0, poses, basis).confused == (1,)
    assert selected(1, poses, basis).confused == (0,)


def test_brows_and_mouth_are_groups_of_their_own():
    basis = features({0: 0.01, 1: 0.01, 2: 0.01, 9: 0.01, 10: 0.01, 11: 0.01})
    found = selected(0, np.eye(1), basis, upper=(3,), apart=True)
    assert sorted(map(set, found.groups), key=min) == [{0, 1, 2}, {9, 10, 11}]
    assert {f for g in selected(0, np.eye(1), basis, upper=(3,)).groups for f in g} >= {0, 9}
    thin = features({0: 0.01, 1: 0.01, 2: 0.01, 9: 0.01})
    assert len(selected(0, np.eye(1), thin, upper=(3,), apart=True).groups) == 1


def test_most_conditions_are_asked_for_all_of_few():
    one, none = np.ones(1), np.zeros(1)
    assert group_firing([one, none]) == [0]
    assert group_firing([one] * 4 + [none]) == [1]
    assert group_firing([one, none, none, none]) == [0]


def test_an_expression_that_another_shows_a_little_of_is_said_to_be():
    """The second shows three tenths of the first; what it does besides is noise."""
    basis = features({3: 0.005}, {7: 0.005})
    noise = np.full(12, 1e-5)
    noise[7] = 0.0015
    first, second = (selected(i, [[1.0, 0.0], [0.3, 1.0]], basis, noise=noise) for i in (0, 1))
    ((other, degree),) = first.shared
    assert other == 1 and degree == pytest.approx(0.3, abs=0.03) and not first.confused
    assert second.confused == (0,)
