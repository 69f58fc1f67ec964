"""Sugeno and Mamdani inference over whole takes.

Every operation is elementwise over frames, so that a frame's answer is bit for bit the same
alone or among others. Frames go in blocks that fit the processor's cache.
"""

from dataclasses import dataclass

import numpy as np

from usdface.errors import InputError
from usdface.fuzzy.defuzzify import defuzzify
from usdface.fuzzy.membership import membership
from usdface.fuzzy.norms import HEDGES, S_NORMS, T_NORMS
from usdface.fuzzy.rules import Combined, Condition, Proposition, Rule
from usdface.fuzzy.system import FuzzySystem, Variable
from usdface.takes import BoolArray, FloatArray, frozen

__all__ = ["Evaluation", "evaluate", "fires_at_neutral"]

# 24 rules over this many frames are 0.8 MB; shorter blocks pay more for each step than they save.
_BLOCK = 4096


@dataclass(frozen=True, eq=False, slots=True)
class Evaluation:
    """What a system answers.

    Attributes
    ----------
    outputs : (F, E) float64
        Each emotion of `FuzzySystem.emotions`, in its range.
    firing : (F, R) float64
        How far each rule fires, its weight included, in [0, 1].
    """

    outputs: FloatArray
    firing: FloatArray

    def __post_init__(self) -> None:
        for name in ("outputs", "firing"):
            if getattr(self, name).flags.writeable:
                object.__setattr__(self, name, frozen(getattr(self, name)))


def evaluate(system: FuzzySystem, inputs: FloatArray) -> Evaluation:
    """Evaluate a system on all frames at once.

    Sugeno: an output is the average of its rules' values, weighted by their firing strengths:
    sum_r f_r z_r / sum_r f_r (Zikky et al. 2013, equation 7). The denominator takes all
    rules or only the output's own (`FuzzySystem.normalisation`); with a neutral rule it also
    takes 1 - max_r f_r, and the numerator that times the output's default. Where the denominator
    is 0 the output is its default. A linear term reads an occluded input as 0.

    Mamdani (Mamdani and Assilian 1975): each rule cuts its conclusion's term, the cut terms are
    joined to one set, which is defuzzified (`usdface.fuzzy.defuzzify`). Where the set is empty the
    output is its default; with a neutral rule the answer counts as far as the strongest rule
    fires, and the default for the rest.

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
    # One row for each output and rule: the work goes row by row, and so does who reads them.
    outputs = np.zeros((len(system.emotions), len(inputs)))
    firing = np.zeros((len(system.rules), len(inputs)))
    answer = _mamdani if system.inference == "mamdani" else _sugeno
    for begin in range(0, len(inputs), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        # Contiguous columns: numpy may round exp and power otherwise where values have gaps.
        columns = np.ascontiguousarray(inputs[block].T)
        strengths = firing[:, block]
        _fire(system, columns, strengths)
        outputs[:, block] = answer(system, columns, strengths)
    for made in (outputs, firing):
        made.setflags(write=False)  # nobody else has them, so that they need no copy
    return Evaluation(outputs.T, firing.T)


def _fire(system: FuzzySystem, columns: FloatArray, firing: FloatArray) -> None:
    """Fill in firing strengths, one row for each rule: (R, F); disabled rules keep their 0."""
    degrees = _Degrees(system, columns)
    for rule, strength in zip(system.rules, firing, strict=True):
        if rule.enabled:
            np.multiply(degrees.of(rule.condition), rule.weight, out=strength)


class _Degrees:
    """How far conditions hold in a block of frames; each proposition is worked out once."""

    def __init__(self, system: FuzzySystem, columns: FloatArray) -> None:
        self._variables = {v.name: (v, columns[i]) for i, v in enumerate(system.inputs)}
        self._norms = {"and": T_NORMS[system.and_], "or": S_NORMS[system.or_]}
        self._known: dict[Proposition, FloatArray] = {}

    def of(self, condition: Condition) -> FloatArray:
        if isinstance(condition, Proposition):
            if condition not in self._known:
                self._known[condition] = self._proposition(condition)
            return self._known[condition]
        if condition.how == "not":
            (part,) = condition.parts
            return np.where(self._seen(part), 1.0 - self.of(part), 0.0)
        degree = self.of(condition.parts[0])
        for part in condition.parts[1:]:
            degree = self._norms[condition.how](degree, self.of(part))
        return degree

    def _proposition(self, proposition: Proposition) -> FloatArray:
        variable, x = self._variables[proposition.variable]
        term = variable.term(proposition.term)
        degree = membership(term.kind, term.parameters, x)
        for hedge in reversed(proposition.hedges):
            degree = HEDGES[hedge](degree)
        return np.where(np.isnan(x), 0.0, degree) if proposition.hedges else degree

    def _seen(self, condition: Condition) -> BoolArray:
        if isinstance(condition, Combined):
            seen = [self._seen(part) for part in condition.parts]
            return np.asarray(np.all(seen, axis=0), dtype=np.bool_)
        return np.asarray(~np.isnan(self._variables[condition.variable][1]))


def _sugeno(system: FuzzySystem, columns: FloatArray, firing: FloatArray) -> FloatArray:
    """Weighted averages, one row for each output: (E, F)."""
    outputs = system.outputs
    count = (len(outputs), firing.shape[1])
    index = {output.name: i for i, output in enumerate(outputs)}
    value, own = np.zeros(count), np.zeros(count)
    product = np.empty(count[1])
    for rule, strength in zip(system.rules, firing, strict=True):
        for output, level in rule.consequents:
            row = index[output]
            np.multiply(strength, _level(outputs[row], level, columns), out=product)
            value[row] += product
            own[row] += strength
    low, high = np.array([v.span for v in outputs]).reshape(-1, 2, 1).swapaxes(0, 1)
    default = np.array([v.default for v in outputs]).reshape(-1, 1)
    if system.normalisation == "weighted_sum":
        return np.clip(np.where(own > 0, value, default), low, high)
    total = own
    if system.normalisation == "all_rules":
        total = np.broadcast_to(_sum(firing), count)
    if system.neutral_rule:
        silence = 1.0 - firing.max(axis=0, initial=0.0)
        total = total + silence
        value += silence * default
    answer = np.divide(value, total, out=np.repeat(default, count[1], axis=1), where=total > 0)
    # The quotient of two rounded sums may leave the range by one unit in the last place.
    return np.asarray(np.clip(answer, low, high), dtype=np.float64)


def _level(output: Variable, level: float | str, columns: FloatArray) -> FloatArray | float:
    """Return the value that a Sugeno rule gives an output: a number, or one for each frame."""
    if not isinstance(level, str):
        return level
    *factors, constant = output.term(level).parameters
    value = np.full(columns.shape[1], constant)
    for factor, column in zip(factors, columns, strict=False):
        value += factor * np.where(np.isfinite(column), column, 0.0)
    return value if factors else constant


def _mamdani(system: FuzzySystem, columns: FloatArray, firing: FloatArray) -> FloatArray:
    """Defuzzified sets, one row for each output: (E, F)."""
    answers = np.zeros((len(system.outputs), columns.shape[1]))
    strongest = firing.max(axis=0, initial=0.0)
    for answer, output in zip(answers, system.outputs, strict=True):
        cuts = [
            (strength, output.term(level))
            for rule, strength in zip(system.rules, firing, strict=True)
            for name, level in rule.consequents
            if name == output.name and isinstance(level, str)
        ]
        answer[:] = defuzzify(system, output, cuts, columns.shape[1])
        if system.neutral_rule:
            answer *= strongest
            answer += (1.0 - strongest) * output.default
    return answers


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
