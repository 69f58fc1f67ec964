"""Sugeno inference over whole takes.

Every operation is elementwise over frames, so that a frame's answer is bit for bit the same
alone or among others.
"""

from dataclasses import dataclass

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import membership
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.takes import FloatArray, frozen

__all__ = ["Evaluation", "evaluate", "fires_at_neutral", "rule_findings"]


@dataclass(frozen=True, eq=False, slots=True)
class Evaluation:
    """What a system answers.

    Attributes
    ----------
    outputs : (F, E) float64
        Each emotion of `FuzzySystem.emotions`, in [0, 1].
    firing : (F, R) float64
        How far each rule fires, its weight included, in [0, 1].
    """

    outputs: FloatArray
    firing: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", frozen(self.outputs))
        object.__setattr__(self, "firing", frozen(self.firing))


def evaluate(system: FuzzySystem, inputs: FloatArray) -> Evaluation:
    """Evaluate a system on all frames at once.

    An output is the average of its rules' values, weighted by their firing strengths:
    sum_r f_r z_r / sum_r f_r (Zikky et al. 2013, equation 7). The denominator takes all
    rules or only the output's own (`FuzzySystem.normalisation`); with a neutral rule it also
    takes 1 - max_r f_r. Where it is 0 the output is 0.

    Parameters
    ----------
    system : FuzzySystem
    inputs : (F, I) float64
        Columns as `FuzzySystem.inputs`. A NaN belongs to no term, so its rules do not fire.

    Raises
    ------
    InputError
        If there are not as many columns as inputs.
    """
    inputs = np.asarray(inputs, dtype=np.float64)
    if inputs.ndim != 2 or inputs.shape[1] != len(system.inputs):
        raise InputError(
            f"fuzzy inputs have shape {inputs.shape}; expected (frames, {len(system.inputs)})"
        )
    firing = _firing(system, inputs)
    columns = {name: i for i, name in enumerate(system.emotions)}
    count = (len(system.emotions), len(inputs))
    value, own = np.zeros(count), np.zeros(count)
    for rule, strength in zip(system.rules, firing, strict=True):
        for output, level in rule.consequents:
            value[columns[output]] += strength * level
            own[columns[output]] += strength
    total = own
    if system.normalisation == "all_rules":
        total = np.broadcast_to(_sum(firing), count)
    if system.neutral_rule:
        total = total + (1.0 - firing.max(axis=0, initial=0.0))
    outputs = np.divide(value, total, out=np.zeros(count), where=total > 0)
    # The quotient of two rounded sums may exceed 1 by one unit in the last place.
    return Evaluation(np.minimum(outputs, 1.0).T, firing.T)


def _firing(system: FuzzySystem, inputs: FloatArray) -> FloatArray:
    """Firing strengths, one row for each rule: (R, F)."""
    combine = np.minimum if system.and_ == "min" else np.multiply
    column = {v.name: (v, inputs[:, i]) for i, v in enumerate(system.inputs)}
    degrees: dict[tuple[str, str], FloatArray] = {}
    firing = np.zeros((len(system.rules), len(inputs)))
    for rule, strength in zip(system.rules, firing, strict=True):
        if not rule.enabled:
            continue
        strength[:] = 1.0
        for pair in rule.antecedent:
            if pair not in degrees:
                variable, x = column[pair[0]]
                term = variable.term(pair[1])
                degrees[pair] = membership(term.kind, term.parameters, x)
            combine(strength, degrees[pair], out=strength)
        strength *= rule.weight
    return firing


def _sum(rows: FloatArray) -> FloatArray:
    """Sum of rows, added in order: numpy's own sum groups terms by the array's size."""
    total = np.zeros(rows.shape[1])
    for row in rows:
        total += row
    return total


def fires_at_neutral(system: FuzzySystem) -> list[Rule]:
    """Return the enabled rules that fire on a neutral face, where every feature is 0."""
    firing = evaluate(system, np.zeros((1, len(system.inputs)))).firing[0]
    return [rule for rule, strength in zip(system.rules, firing, strict=True) if strength > 0]


def rule_findings(system: FuzzySystem) -> list[Finding]:
    """Return what is doubtful about the rules: firing at neutral, or never."""
    neutral = [
        finding("RULE_FIRES_AT_NEUTRAL", str(rule), f"the rule {rule} fires on a neutral face")
        for rule in fires_at_neutral(system)
    ]
    silent = [
        finding("RULE_UNREACHABLE", str(rule), f"the rule {rule} is disabled or has no weight")
        for rule in system.rules
        if not rule.enabled or rule.weight == 0
    ]
    return neutral + silent
