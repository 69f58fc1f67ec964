import numpy as np

from usdface.arrays import frozen


def test_frozen_copies_only_what_could_change() -> None:
    once = frozen(np.arange(3.0))
    assert frozen(once) is once
    assert frozen([1, 2], np.int64).dtype == np.int64
    assert frozen(np.ones((4, 6))[:, ::2]).flags.c_contiguous
