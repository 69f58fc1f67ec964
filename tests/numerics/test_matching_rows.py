import numpy as np

from usdface.numerics.matching_rows import matching_rows


def test_rows_are_found_for_repeated_indices_in_any_order() -> None:
    where, rows = matching_rows(np.array([2, 5, 9]), np.array([9, 3, 2, 9, 12]))
    assert where.tolist() == [0, 2, 3]
    assert rows.tolist() == [2, 0, 2]


def test_an_empty_array_has_no_row() -> None:
    where, rows = matching_rows(np.zeros(0, np.int64), np.array([1, 2]))
    assert where.size == rows.size == 0
