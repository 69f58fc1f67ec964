from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze, frozen


def test_frozen_copies_only_what_could_change() -> None:
    once = frozen(np.arange(3.0))
    assert frozen(once) is once
    assert frozen([1, 2], np.int64).dtype == np.int64
    assert frozen(np.ones((4, 6))[:, ::2]).flags.c_contiguous


@dataclass(frozen=True, eq=False, slots=True)
class _Pair:
    first: FloatArray
    second: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "first", "second")


def test_arrays_of_a_frozen_dataclass_are_frozen_and_none_stays_none() -> None:
    given = np.arange(3)
    pair = _Pair(given)
    given[0] = 7
    assert pair.first.tolist() == [0.0, 1.0, 2.0]
    assert not pair.first.flags.writeable
    assert pair.second is None
