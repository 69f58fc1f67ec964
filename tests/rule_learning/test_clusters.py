import numpy as np
import pytest
from scipy.cluster.hierarchy import linkage

from usdface.rule_learning.clusters import clusters


@pytest.mark.parametrize("count", [2, 3, 10])
def test_there_are_as_many_groups_as_are_asked_for(count: int) -> None:
    tree = linkage(np.random.default_rng(count).normal(size=(count, 3)), "average")
    for most in range(1, count + 4):
        assert len(np.unique(clusters(tree, most))) == min(most, count)


def test_what_lies_together_is_a_group() -> None:
    tree = linkage(np.array([[0.0], [10.0], [0.1], [10.2], [20.0]]), "average")
    groups = clusters(tree, 3)
    assert groups[0] == groups[2] and groups[1] == groups[3]
    assert len(np.unique(groups)) == 3


def test_of_two_pairs_that_are_equally_near_neither_is_parted_alone() -> None:
    tree = linkage(np.array([[0.0], [1.0], [10.0], [11.0]]), "average")
    assert len(np.unique(clusters(tree, 3))) == 2
