"""Design of a system by the fuzzy paper: from one pose of each expression.

Zikky, Hariadi, Muhtadin 2013, section 4: Low, Medium and High of an input come from its
minimum, medium and maximum over the reference poses (here the median; the paper does not define
the medium). The paper's rules were written by hand. They are used with its thirteen inputs and six
emotions; otherwise each reference gives one rule, of the terms that it meets and the others do not
(L.-X. Wang, J. Mendel, "Generating Fuzzy Rules by Learning from Examples", 1992).
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import membership
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.options import FeatureSpace
from usdface.rule_design.paper_system import EMOTIONS, MEDIUM, RULES, three_terms

__all__ = ["fit_paper"]

# As many conditions as the paper's longest rule has.
_CONDITIONS = 3
# In standard deviations of a feature's noise, between the least and the largest reference: as in
# `usdface.rule_design.feature_selection`.
_LEAST_RANGE = 4.0
# Numerical guard for features without noise [face unit], half a micrometre.
_LEAST_MOTION = 1e-5
# Chosen by hand, no experiment: least decrease of the cost by one more condition; how far a pose
# has to meet its own rule; cost of a feature that differs between the references by its noise only.
_LEAST_GAIN = 0.01
_MET = 0.5
_NOISE_COST = 4.0
# Numerical: costs are rounded, as the choice between mirrored markers must not hang on last bits.
_DIGITS = 9


def fit_paper(
    features: Sequence[MarkerFeature],
    references: FloatArray,
    emotions: Sequence[str],
    noise: FloatArray,
    space: FeatureSpace = "character",
) -> tuple[ExpressionSystem, list[Finding]]:
    """Design a system from reference poses.

    Parameters
    ----------
    features : sequence of MarkerFeature, length I
        "absolute" ones.
    references : (R, I) float64 [face unit]
        Features of the reference poses; several may show one emotion.
    emotions : sequence of str, length R
    noise : (I,) float64 [face unit]
        Standard deviation of each feature on a neutral face; inputs within it are not used.
    space : {"take", "character"}
        Where the features were measured.

    Returns
    -------
    system : ExpressionSystem
        Without an else rule, as the paper's: outputs at neutral may differ from 0.
    findings : list of Finding
        EXPRESSION_UNSEEN for each emotion that gets no rule.

    Raises
    ------
    InputError
        If fewer than two emotions are shown, or no feature differs between the poses.
    """
    names = tuple(dict.fromkeys(emotions))
    if len(names) < 2:
        raise InputError(f"the paper's design compares reference poses; found only {names}")
    low, high = references.min(axis=0), references.max(axis=0)
    usable = high - low > np.maximum(_LEAST_RANGE * noise, _LEAST_MOTION)
    given = [
        Variable(
            feature.name,
            "input",
            three_terms(*sorted(map(float, (a, np.median(column), b)))) if used else (),
        )
        for feature, a, b, column, used in zip(
            features, low, high, references.T, usable, strict=True
        )
    ]
    if set(MEDIUM) <= {v.name for v in given if v.terms} and set(EMOTIONS) <= set(names):
        rules = tuple(parse_rule(text) for text in RULES)
    else:
        small = (noise / np.maximum(high - low, _LEAST_MOTION)) ** 2
        rules = _rules(given, references, emotions, _NOISE_COST * small)
    used_inputs = {p.variable for rule in rules for p in rule.propositions}
    inputs = [v for v in given if v.name in used_inputs]
    used_features = tuple(feature for feature in features if feature.name in used_inputs)
    outputs = [Variable(name, "output") for name in names]
    fuzzy = FuzzySystem((*inputs, *outputs), rules, normalisation="all_rules")
    system = ExpressionSystem(fuzzy, used_features, space=space, mode="add")
    concluded = {output for rule in rules for output, _ in rule.consequents}
    return system, [
        finding(
            "EXPRESSION_UNSEEN",
            name,
            "no motion distinguishes {expression} from the others; it gets no rule",
            name,
        )
        for name in names
        if name not in concluded
    ]


def _rules(
    variables: Sequence[Variable],
    references: FloatArray,
    emotions: Sequence[str],
    cost: FloatArray,
) -> tuple[Rule, ...]:
    """Return a rule for each reference that has terms of its own.

    `cost` (I,) is that of a feature's noise.
    """
    table: list[tuple[int, Term]] = [(i, t) for i, v in enumerate(variables) for t in v.terms]
    if not table:
        raise InputError("no marker moves differently in two reference poses")
    memberships = np.array([membership(t.kind, t.parameters, references[:, i]) for i, t in table]).T
    marker = np.array([i // 3 for i, _ in table])
    # A neutral face is Low in everything; the first condition is another term.
    neutral = np.array([t.name == "low" for _, t in table])
    texts: list[str] = []
    for row, emotion in enumerate(emotions):
        rivals = [k for k, other in enumerate(emotions) if other != emotion]
        noise = cost[[i for i, _ in table]]
        chosen = _distinctive_terms(memberships[row], memberships[rivals], marker, neutral, noise)
        if memberships[row, chosen].min() < _MET:
            continue
        conditions = (f"{variables[table[c][0]].name} IS {table[c][1].name}" for c in chosen)
        texts.append(f"IF {' AND '.join(conditions)} THEN {emotion} IS 1")
    return tuple(parse_rule(text) for text in dict.fromkeys(texts))


def _distinctive_terms(
    own: FloatArray, rivals: FloatArray, marker: IntArray, neutral: BoolArray, noise: FloatArray
) -> list[int]:
    """Return the terms that one pose meets and its rivals together do not, the best first."""
    chosen: list[int] = []
    met, fired, least = 1.0, np.ones((len(rivals), 1)), np.inf
    while len(chosen) < _CONDITIONS:
        together, others = np.minimum(own, met), np.minimum(rivals, fired) ** 2
        cost = (1 - together) ** 2 + others.mean(axis=0) + others.max(axis=0)
        cost = np.round(cost + np.maximum(noise, noise[chosen].max(initial=0.0)), _DIGITS)
        taken = np.isin(marker, marker[chosen])
        cost[taken if chosen else neutral] = np.inf
        best = int(np.argmin(cost))
        if not cost[best] < least - _LEAST_GAIN:
            break
        chosen, least = [*chosen, best], float(cost[best])
        met, fired = float(together[best]), np.sqrt(others[:, [best]])
    return chosen
