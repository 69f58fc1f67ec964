import numpy as np
import pytest

from usdface.errors import InputError
from usdface.rigs import Skeleton


def test_transforms_fit_their_joints() -> None:
    with pytest.raises(InputError, match="2, 4, 4"):
        Skeleton(("a", "a/b"), ("a", "b"), np.eye(4)[None], np.eye(4)[None])


def test_parents_follow_from_paths() -> None:
    joints = ("a", "a/b", "c", "a/b/c")
    skeleton = Skeleton(joints, joints, *np.tile(np.eye(4), (2, 4, 1, 1)))
    assert skeleton.parents == (-1, 0, -1, 1)
