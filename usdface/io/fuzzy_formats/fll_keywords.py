"""Keywords of FLL, the language of fuzzylite.

Rada-Vilela, "The FuzzyLite Libraries for Fuzzy Logic Control", 2018, https://fuzzylite.com.
"""

__all__ = ["DEFUZZIFIERS", "FLL_KINDS", "SAMPLES", "S_NORMS", "T_NORMS"]

FLL_KINDS = {
    "triangular": "Triangle",
    "trapezoidal": "Trapezoid",
    "ramp": "Ramp",
    "gaussian": "Gaussian",
    "gaussian_pair": "GaussianProduct",
    "sigmoid": "Sigmoid",
    "bell": "Bell",
    "s_shape": "SShape",
    "z_shape": "ZShape",
    "pi_shape": "PiShape",
    "points": "Discrete",
    "constant": "Constant",
    "linear": "Linear",
}
T_NORMS = {
    "min": "Minimum",
    "prod": "AlgebraicProduct",
    "lukasiewicz": "BoundedDifference",
    "hamacher": "HamacherProduct",
    "einstein": "EinsteinProduct",
    "drastic": "DrasticProduct",
    "nilpotent": "NilpotentMinimum",
}
S_NORMS = {
    "max": "Maximum",
    "probor": "AlgebraicSum",
    "lukasiewicz": "BoundedSum",
    "hamacher": "HamacherSum",
    "einstein": "EinsteinSum",
    "drastic": "DrasticSum",
    "nilpotent": "NilpotentMaximum",
    "sum": "UnboundedSum",
}
DEFUZZIFIERS = {
    "centroid": "Centroid",
    "bisector": "Bisector",
    "mean_of_max": "MeanOfMaximum",
    "smallest_of_max": "SmallestOfMaximum",
    "largest_of_max": "LargestOfMaximum",
}
# fuzzylite's own, where a file names none.
SAMPLES = 1000
