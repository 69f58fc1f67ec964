"""Keywords of FCL, IEC 61131-7:2000, and those that other programs add to it."""

__all__ = [
    "ACCU",
    "AND",
    "DUAL_AND",
    "DUAL_OR",
    "JFUZZY",
    "JFUZZY_NORMS",
    "METHODS",
    "OR",
    "SMOOTH",
]

AND = {
    "min": "MIN",
    "prod": "PROD",
    "lukasiewicz": "BDIF",
    "hamacher": "HPROD",
    "einstein": "EPROD",
    "drastic": "DPROD",
    "nilpotent": "NMIN",
}
OR = {
    "max": "MAX",
    "probor": "ASUM",
    "lukasiewicz": "BSUM",
    "hamacher": "HSUM",
    "einstein": "ESUM",
    "drastic": "DSUM",
    "nilpotent": "NMAX",
}
ACCU = OR | {"sum": "SUM"}
METHODS = {
    "centroid": "COG",
    "bisector": "COA",
    "smallest_of_max": "LM",
    "largest_of_max": "RM",
    "mean_of_max": "MM",
}
DUAL_AND = dict(zip(OR, AND, strict=True))
DUAL_OR = dict(zip(AND, OR, strict=True))
# jFuzzyLogic's words, and where their parameters stand among ours.
JFUZZY: dict[str, tuple[str, tuple[int, ...]]] = {
    "trian": ("triangular", (0, 1, 2)),
    "trape": ("trapezoidal", (0, 1, 2, 3)),
    "gauss": ("gaussian", (0, 1)),
    "gbell": ("bell", (2, 0, 1)),
    "sigm": ("sigmoid", (1, 0)),
}
JFUZZY_NORMS: dict[str, dict[str, str]] = {
    "and_": {"hamacher": "HAMACHER", "drastic": "DMIN", "nilpotent": "NIPMIN"},
    "or_": {"einstein": "EINSTEIN", "drastic": "DMAX", "nilpotent": "NIPMAX"},
    "aggregation": {"probor": "PROBOR"},
}
SMOOTH = ("gaussian", "gaussian_pair", "sigmoid", "bell", "s_shape", "z_shape", "pi_shape")
