import numpy as np

from usdface.numerics.seen_mean import seen_mean


def test_missing_values_weigh_nothing_and_where_all_are_missing_there_is_no_mean() -> None:
    values = np.array([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan]])
    np.testing.assert_array_equal(seen_mean(values), [2.0, 5.0, np.nan])
    assert np.isnan(seen_mean(np.zeros((0, 2)))).all()
