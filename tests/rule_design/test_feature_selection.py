import numpy as np
import pytest

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.rule_design.feature_selection import paired_movements, single_movements
from usdface.rule_design.feature_selection import select_features as select

LOW = np.zeros(9, dtype=bool)  # three markers, none above the nose tip


def features(*moves, markers=3):
    """One row per shape; a move is {feature: metres}."""
    rows = np.zeros((len(moves), 3 * markers))
    for row, move in zip(rows, moves, strict=True):
        row[list(move)] = list(move.values())
    return rows


def selected(index, poses, moves, basis, noise, upper=()):
    """No single movements, the same noise everywhere; markers `upper` above the nose tip."""
    noise = np.full(basis.shape[1], noise)
    above = np.isin(np.arange(basis.shape[1]) // 3, list(upper))
    evaluator = BlendShapeEvaluator(basis)
    return select(index, poses, np.zeros((0, len(basis))), moves, evaluator, noise, above)


def movements(names, basis):
    single = single_movements(names)
    return np.concatenate([single, paired_movements(names, single, BlendShapeEvaluator(basis))])


def test_movements_are_alone_both_sides_and_two_at_a_time():
    names = ("smile_L", "smile_R", "jaw")
    found = movements(names, features({0: 1.0}, {3: 1.0}, {6: 1.0}))
    rows = {tuple(row) for row in found}
    assert rows == {(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1)}


@pytest.mark.parametrize(
    "pair",
    [
        ("mouthSmileLeft", "mouthSmileRight"),
        ("mouthSmile_L", "mouthSmile_R"),
        ("eye-left-slit", "eye-right-slit"),
        ("L_smile", "R_smile"),
        ("smile.l", "smile.r"),
    ],
)
def test_sides_are_known_by_their_names(pair):
    assert (movements(pair, np.ones((2, 3))) == [1, 1]).all(axis=1).any()
    other = (pair[0], "Lower" + pair[1])
    assert not (movements(other, np.ones((2, 3))) == [1, 1]).all(axis=1)[:-1].any()


def test_the_feature_that_tells_apart_goes_before_the_one_that_moves_most():
    # Feature 1 moves in both poses; feature 4 only in the first.
    basis = features({1: 0.02, 4: 0.006}, {1: 0.02})
    selection = selected(0, np.eye(2), np.zeros((0, 2)), basis, 0.0003)
    assert selection.ramps.keys() == {4}
    assert selection.ramps[4][1] == pytest.approx(0.94 * 0.006)
    assert selection.confused == ()


def test_together_where_neither_does_alone():
    basis = features({1: 0.01}, {4: 0.01})
    poses = np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    selection = selected(0, poses, np.eye(2), basis, 0.0003)
    assert selection.ramps.keys() == {1, 4}
    assert selection.confused == ()


def test_signs_are_kept_and_the_dead_zone_lies_between():
    basis = features({1: -0.01})
    foot, top = selected(0, np.eye(1), np.eye(1), basis, 0.001).ramps[1]
    assert top == pytest.approx(-0.0094)
    assert top < foot < 0


def test_what_hides_in_the_noise_is_not_chosen():
    basis = features({1: 0.01, 4: 0.001})
    loud = selected(0, np.eye(1), np.zeros((0, 1)), basis, 0.0005)
    assert loud.ramps.keys() == {1}
    assert selected(0, np.eye(1), np.zeros((0, 1)), basis, 0.005).ramps == {}


def test_one_pose_within_another_excludes_what_the_other_does_besides():
    basis = features({1: 0.01}, {4: 0.01})
    poses = np.array([[1.0, 0.0], [1.0, 1.0]])
    part, whole = (selected(i, poses, np.eye(2), basis, 0.0003) for i in (0, 1))
    assert part.ramps.keys() == {1} and [i for i, _ in part.negative] == [4]
    assert not whole.negative
    assert not part.confused and not part.shared and not whole.confused


@pytest.mark.parametrize(("brows", "read"), [(0.006, {1, 7}), (0.004, {1})])
def test_brows_that_move_far_are_read_though_no_rival_asks_for_it(brows, read):
    """The mouth tells the pose from all that moves alone; what comes together nobody has listed."""
    basis = features({1: 0.01}, {4: 0.004, 7: brows}, {4: 0.01})
    poses = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert selected(0, poses, np.eye(3)[1:], basis, 0.0003, (2,)).ramps.keys() == read


def test_poses_that_differ_in_what_no_marker_sees_are_confused():
    basis = features({1: 0.01}, {})
    poses = np.array([[1.0, 0.0], [1.0, 1.0]])
    assert selected(0, poses, np.eye(2), basis, 0.0003).confused == (1,)
    assert selected(1, poses, np.eye(2), basis, 0.0003).confused == (0,)


def test_a_quiet_feature_goes_before_a_noisy_one_of_the_same_size():
    basis = features({1: 0.01, 4: 0.01})
    noise = np.full(9, 0.0001)
    noise[1] = 0.001
    none = np.zeros((0, 1))
    assert select(
        0, np.eye(1), none, none, BlendShapeEvaluator(basis), noise, LOW
    ).ramps.keys() == {4}


def test_the_worst_rival_counts_however_many_are_harmless():
    """One movement that looks just like the expression, among a thousand that do not."""
    basis = features({1: 0.01, 4: 0.01}, {1: 0.01}, {7: 0.01})
    poses = np.array([[1.0, 0.0, 0.0]])
    moves = np.concatenate([[[0.0, 1.0, 0.0]], np.tile([0.0, 0.0, 1.0], (1000, 1))])
    noise = np.full(9, 0.0001)
    noise[4] = 0.0003  # telling it apart costs noise
    assert 4 in select(0, poses, moves[:0], moves, BlendShapeEvaluator(basis), noise, LOW).ramps


def test_an_expression_that_another_shows_a_little_of_is_said_to_be():
    """The second shows three tenths of the first; what it does besides hardly leaves the noise."""
    basis = features({3: 0.005}, {7: 0.005})
    poses = np.array([[1.0, 0.0], [0.3, 1.0]])
    none, noise = np.zeros((0, 2)), np.full(9, 1e-5)
    noise[7] = 0.001
    first, second = (
        select(i, poses, none, none, BlendShapeEvaluator(basis), noise, LOW) for i in (0, 1)
    )
    ((other, degree),) = first.shared
    assert other == 1 and degree == pytest.approx(0.3, abs=0.03) and not first.confused
    assert not second.shared and not second.confused
