import numpy as np

from usdface.geometry.gap_interpolation import interpolate_gaps

TIMES = np.array([0.0, 0.1, 0.4, 0.5, 0.9, 1.0])
LINES = np.stack([2.0 * TIMES + 1.0, -TIMES], axis=1)


def test_what_moves_on_a_line_in_time_comes_back() -> None:
    hidden = np.zeros(LINES.shape, dtype=bool)
    hidden[1:3, 0] = hidden[2:5, 1] = True
    filled = interpolate_gaps(np.where(hidden, np.nan, LINES), hidden, TIMES)
    np.testing.assert_allclose(filled, LINES, atol=1e-15)


def test_gaps_at_the_ends_are_held() -> None:
    hidden = np.zeros(LINES.shape, dtype=bool)
    hidden[:2, 0] = hidden[-1, 0] = True
    filled = interpolate_gaps(np.where(hidden, np.nan, LINES), hidden, TIMES)
    np.testing.assert_array_equal(filled[:2, 0], LINES[2, 0])
    assert filled[-1, 0] == LINES[-2, 0]


def test_a_column_without_a_value_stays() -> None:
    hidden = np.zeros(LINES.shape, dtype=bool)
    hidden[:, 1] = True
    np.testing.assert_array_equal(interpolate_gaps(LINES, hidden, TIMES), LINES)
