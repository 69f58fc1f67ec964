"""Factors from robust measures of white noise to its standard deviation."""

__all__ = ["MEDIAN_TO_DEVIATION", "THIRD_DIFFERENCE"]

# Deviation of normally distributed values by their median absolute value: 1 over the quantile 3/4
# of the standard normal distribution (F. Hampel, "The influence curve and its role in robust
# estimation", 1974).
MEDIAN_TO_DEVIATION = 1.4826
# Variance of the third difference of white noise by that of the noise: the sum of the squared
# coefficients 1, -3, 3, -1.
THIRD_DIFFERENCE = 20.0
