import numpy as np
import pytest

from usdface.errors import InputError
from usdface.rigs import Skeleton


def test_transforms_fit_their_joints() -> None:
    with pytest.raises(InputError, match="2, 4, 4"):
        Skeleton(("a", "a/b"), ("a", "b"), np.eye(4)[None], np.eye(4)[None])
