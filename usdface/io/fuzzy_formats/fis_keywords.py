"""Keywords of MATLAB's .fis.

MathWorks, Fuzzy Logic Toolbox User's Guide, "Fuzzy Inference System file".
"""

from usdface.fuzzy.system import FuzzySystem

__all__ = [
    "AGGREGATIONS",
    "AND",
    "DEFUZZIFIERS",
    "HEDGES",
    "KINDS",
    "MATLABS_SAMPLES",
    "OCTAVES_S_NORMS",
    "OCTAVES_T_NORMS",
    "OR",
    "RAMPS",
    "counts_from_0",
]

# For each kind: MATLAB's name, and where its parameters stand among ours.
KINDS: dict[str, tuple[str, tuple[int, ...]]] = {
    "triangular": ("trimf", (0, 1, 2)),
    "trapezoidal": ("trapmf", (0, 1, 2, 3)),
    "gaussian": ("gaussmf", (1, 0)),
    "gaussian_pair": ("gauss2mf", (1, 0, 3, 2)),
    "sigmoid": ("sigmf", (1, 0)),
    "bell": ("gbellmf", (1, 2, 0)),
    "s_shape": ("smf", (0, 1)),
    "z_shape": ("zmf", (0, 1)),
    "pi_shape": ("pimf", (0, 1, 2, 3)),
}
# Ramps, and how many parameters they have; fuzzylite's foot may lie on either side.
RAMPS = {"linsmf": 2, "linzmf": 2, "rampmf": 2}
AND = {"min": "min", "prod": "prod"}
OR = {"max": "max", "probor": "probor"}
AGGREGATIONS = {"max": "max", "probor": "probor", "sum": "sum"}
DEFUZZIFIERS = {
    "centroid": "centroid",
    "bisector": "bisector",
    "mean_of_max": "mom",
    "smallest_of_max": "som",
    "largest_of_max": "lom",
}
MATLABS_SAMPLES = 101  # evalfis' default number of sample points

# Additions of Octave's fuzzy-logic-toolkit; read, but not written, as MATLAB does not know it.
OCTAVES_T_NORMS = {
    "prod": "algebraic_product",
    "lukasiewicz": "bounded_difference",
    "hamacher": "hamacher_product",
    "einstein": "einstein_product",
    "drastic": "drastic_product",
}
OCTAVES_S_NORMS = {
    "probor": "algebraic_sum",
    "lukasiewicz": "bounded_sum",
    "hamacher": "hamacher_sum",
    "einstein": "einstein_sum",
    "drastic": "drastic_sum",
}
# Octave's hedges are hundredths of an index: ten times the power that a degree is raised to.
HEDGES: dict[int, tuple[str, ...]] = {0: (), 5: ("somewhat",), 20: ("very",), 40: ("very", "very")}


def counts_from_0(system: FuzzySystem) -> bool:
    """Whether MATLAB gives another maximum: its som and lom go by the distance to 0."""
    ends = system.defuzzifier in ("smallest_of_max", "largest_of_max")
    below = any(v.span[0] < 0 for v in system.outputs)
    return system.inference == "mamdani" and ends and below
