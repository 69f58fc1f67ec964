"""Sugeno and Mamdani inference over whole takes.

Every operation is elementwise over frames, so that the outputs of a frame are bit for bit the same
alone or among others. Frames are evaluated in blocks that fit the processor's cache.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray, frozen
from usdface.errors import InputError
from usdface.fuzzy.condition_degrees import ConditionDegrees, input_memberships
from usdface.fuzzy.defuzzify import defuzzify
from usdface.fuzzy.rules import Proposition, Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable

__all__ = ["Evaluation", "evaluate", "rules_firing_at"]

# A row of this many frames is 64 kB; shorter ones pay more for each step than they save.
_BLOCK = 8192


@dataclass(frozen=True, eq=False, slots=True)
class Evaluation:
    """The evaluation of a system: outputs, firing strengths, memberships.

    Attributes
    ----------
    outputs : (F, E) float64
        Columns as `FuzzySystem.outputs`, each in its range.
    firing : (F, R) float64
        Firing strength of each rule, its weight included, in [0, 1].
    memberships : mapping of Proposition to (F,) float64
        The degree of each term of the inputs, and of each proposition of the rules; empty unless
        requested.
    """

    outputs: FloatArray
    firing: FloatArray
    memberships: Mapping[Proposition, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("outputs", "firing"):
            if getattr(self, name).flags.writeable:
                object.__setattr__(self, name, frozen(getattr(self, name)))


def evaluate(system: FuzzySystem, inputs: FloatArray, *, memberships: bool = False) -> Evaluation:
    """Evaluate a system on all frames at once.

    Sugeno: an output is the average of its rules' values, weighted by their firing strengths:
    sum_r f_r z_r / sum_r f_r (Zikky et al. 2013, equation 7). The denominator takes all
    rules or only the output's own (`FuzzySystem.normalisation`); with an else rule it also
    takes 1 - max_r f_r, and the numerator that times the output's default. Where the denominator
    is 0 the output is its default. A linear term reads an occluded input as 0.

    Mamdani (Mamdani and Assilian 1975): each rule cuts its conclusion's term, the cut terms are
    joined to one set, which is defuzzified (`usdface.fuzzy.defuzzify`). Where the set is empty the
    output is its default; with an else rule it is the average of the defuzzified value, weighted by
    the largest firing strength, and the default.

    Parameters
    ----------
    system : FuzzySystem
    inputs : (F, I) float64
        Columns as `FuzzySystem.inputs`. NaN = occluded: it belongs to no term, so its rules do not
        fire; a negation has its least degree over all values: ``NOT (a AND b)`` with an occluded
        `a` is ``1 - b``.
    memberships : bool
        Keep the degrees of terms and propositions.

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
    # One row for each rule and output: they are computed and read row by row.
    made = np.empty((len(system.rules) + len(system.output_names), len(inputs)))
    firing, outputs = np.split(made, [len(system.rules)])
    fill_outputs = _mamdani if system.inference == "mamdani" else _sugeno
    degrees = ConditionDegrees(system)
    for begin in range(0, len(inputs), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        # Contiguous columns: numpy may round exp and power otherwise where values have gaps.
        columns = np.ascontiguousarray(inputs[block].T)
        degrees.read(columns)
        _fire(system, degrees, firing[:, block])
        with np.errstate(invalid="ignore"):
            fill_outputs(system, columns, firing[:, block], outputs[:, block])
    for rows in (outputs, firing):
        rows.setflags(write=False)  # not shared, so that `frozen` need not copy them
    return Evaluation(outputs.T, firing.T, input_memberships(system, inputs) if memberships else {})


def _fire(system: FuzzySystem, degrees: ConditionDegrees, firing: FloatArray) -> None:
    """Fill in firing strengths, one row for each rule: (R, F); disabled rules do not fire."""
    for rule, strength in zip(system.rules, firing, strict=True):
        if not rule.enabled:
            strength[:] = 0.0
            continue
        degree = degrees.of(rule.antecedent, strength)
        if degree is not strength or rule.weight != 1.0:
            np.multiply(degree, rule.weight, out=strength)


def _sugeno(
    system: FuzzySystem, columns: FloatArray, firing: FloatArray, values: FloatArray
) -> None:
    """Fill in weighted averages, one row for each output."""
    conclusions = _conclusions(system, firing)
    joint = system.normalisation == "all_rules"
    totals = np.empty((1 if joint else len(values), firing.shape[1]))
    if joint:
        _sum(firing, totals[0])
    product = np.empty(firing.shape[1])
    for i, output in enumerate(system.outputs):
        conclusion = conclusions[output.name]
        levels = [(strength, _level(output, level, columns)) for strength, level in conclusion]
        _weighted_sum(levels, values[i], product)
        if not joint:
            _sum([strength for strength, _ in conclusion], totals[i])
    default = np.reshape([output.default for output in system.outputs], (-1, 1))
    if system.normalisation != "weighted_sum":
        if system.else_rule:
            else_strength = 1.0 - firing.max(axis=0, initial=0.0)
            totals += else_strength
            if default.any():
                values += else_strength * default
        values /= totals  # 0 / 0 becomes the default, as follows
    np.copyto(values, default, where=totals <= 0)
    # The quotient of two rounded sums may leave the range by one unit in the last place.
    for output, value in zip(system.outputs, values, strict=True):
        value.clip(*output.span, out=value)


def _weighted_sum(
    levels: Sequence[tuple[FloatArray, FloatArray | float]], value: FloatArray, product: FloatArray
) -> None:
    """Fill in the sum of strengths times levels, in order; `product` is a buffer."""
    into = value
    for strength, level in levels:
        if isinstance(level, float) and level == 0.0:
            continue  # it would add nothing
        np.multiply(strength, level, out=into)
        if into is product:
            value += product
        into = product
    if into is value:
        value[:] = 0.0


def _conclusions(
    system: FuzzySystem, firing: FloatArray
) -> dict[str, list[tuple[FloatArray, float | str]]]:
    """Return firing strength and consequent of each rule, by output."""
    conclusions: dict[str, list[tuple[FloatArray, float | str]]] = {
        name: [] for name in system.output_names
    }
    for rule, strength in zip(system.rules, firing, strict=True):
        for output, level in rule.consequents:
            conclusions[output].append((strength, level))
    return conclusions


def _level(output: Variable, level: float | str, columns: FloatArray) -> FloatArray | float:
    """Return the consequent of a Sugeno rule: a number, or one for each frame."""
    if not isinstance(level, str):
        return level
    *factors, constant = output.term(level).parameters
    value = np.full(columns.shape[1], constant)
    for factor, column in zip(factors, columns, strict=False):
        value += factor * np.where(np.isfinite(column), column, 0.0)
    return value if factors else constant


def _mamdani(
    system: FuzzySystem, columns: FloatArray, firing: FloatArray, values: FloatArray
) -> None:
    """Fill in defuzzified sets, one row for each output."""
    strongest = firing.max(axis=0, initial=0.0)
    conclusions = _conclusions(system, firing)
    for output, value in zip(system.outputs, values, strict=True):
        conclusion = conclusions[output.name]
        cuts = [
            (strength, output.term(level))
            for strength, level in conclusion
            if isinstance(level, str)
        ]
        value[:] = defuzzify(system, output, cuts, columns.shape[1])
        if system.else_rule:
            value *= strongest
            value += (1.0 - strongest) * output.default


def _sum(rows: Sequence[FloatArray] | FloatArray, total: FloatArray) -> None:
    """Sum rows, added in order: numpy's own sum groups terms by the array's size."""
    if len(rows) < 2:
        total[:] = rows[0] if len(rows) else 0.0
        return
    np.add(rows[0], rows[1], out=total)
    for row in rows[2:]:
        total += row


def rules_firing_at(system: FuzzySystem, values: FloatArray) -> list[Rule]:
    """Return the enabled rules that fire at one point of the inputs, `values` (I,)."""
    firing = evaluate(system, np.reshape(values, (1, -1))).firing[0]
    return [rule for rule, strength in zip(system.rules, firing, strict=True) if strength > 0]
