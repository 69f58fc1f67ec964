"""Degrees to which propositions and conditions hold, frame by frame."""

from functools import reduce

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.fuzzy.membership import KINDS
from usdface.fuzzy.norms import HEDGES, S_NORMS, T_NORMS, most_of
from usdface.fuzzy.rules import Condition, Proposition, propositions
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable

__all__ = ["ConditionDegrees", "input_memberships"]


def input_memberships(system: FuzzySystem, inputs: FloatArray) -> dict[Proposition, FloatArray]:
    """Return the degrees (F,) of all terms of the inputs and of all propositions of the rules.

    `inputs` (F, I) are in the order of the variables; NaN is to no degree anything.
    """
    columns = {variable.name: i for i, variable in enumerate(system.inputs)}
    requested = [Proposition(v.name, term.name) for v in system.inputs for term in v.terms]
    requested += [proposition for rule in system.rules for proposition in rule.propositions]
    degrees = {}
    for proposition in dict.fromkeys(requested):
        column = columns[proposition.variable]
        x = np.ascontiguousarray(inputs[:, column])
        degree = _degree(system.inputs[column], proposition, x)
        degrees[proposition] = np.where(np.isnan(x), 0.0, degree)
    return degrees


class ConditionDegrees:
    """Degrees of conditions in a block of frames; each proposition is evaluated once."""

    def __init__(self, system: FuzzySystem) -> None:
        self._inputs = {v.name: (i, v) for i, v in enumerate(system.inputs)}
        self._norms = {"and": T_NORMS[system.and_], "or": S_NORMS[system.or_]}
        self._missing, unread = np.zeros((len(self._inputs), 0), dtype=np.bool_), np.zeros(0)
        enabled = (rule for rule in system.rules if rule.enabled)
        self._known = {p: unread for rule in enabled for p in rule.propositions}

    def read(self, columns: FloatArray) -> None:
        """Evaluate the propositions on a block of frames (I, F).

        Arrays of the previous block are replaced one by one: allocating all of them anew takes as
        long as the evaluation itself.
        """
        self._missing = np.asarray(np.isnan(columns))
        some = bool(self._missing.any())
        for proposition in self._known:
            i, variable = self._inputs[proposition.variable]
            degree = _degree(variable, proposition, columns[i])
            if some:
                degree = np.where(self._missing[i], 0.0, degree)
            self._known[proposition] = degree

    def of(self, condition: Condition, buffer: FloatArray | None = None) -> FloatArray:
        """Return the degree of a condition: (F,). `buffer` (F,) may be overwritten with it."""
        if isinstance(condition, Proposition):
            return self._known[condition]
        if condition.how == "not":
            (part,) = condition.parts
            return np.asarray(1.0 - self._highest(part))
        if condition.how == "most":
            return most_of([self.of(part) for part in condition.parts])
        norm = self._norms[condition.how]
        into = {"out": buffer} if isinstance(norm, np.ufunc) else {}
        degree = self.of(condition.parts[0])
        for part in condition.parts[1:]:
            degree = norm(degree, self.of(part), **into)
        return degree

    def _highest(self, condition: Condition) -> FloatArray:
        """Return the largest degree of a condition over all values of the NaN inputs: (F,).

        All connectives but the negation grow with their parts.
        """
        missing = self._lacks(condition)
        if not missing.any():
            return self.of(condition)
        if isinstance(condition, Proposition):
            return np.where(missing, 1.0, self.of(condition))
        if condition.how == "not":
            return np.asarray(1.0 - self.of(condition.parts[0]))
        parts = [self._highest(part) for part in condition.parts]
        if condition.how == "most":
            return most_of(parts)
        return np.asarray(reduce(self._norms[condition.how], parts))

    def _lacks(self, condition: Condition) -> BoolArray:
        """Return the frames in which an input of the condition is NaN."""
        read = [self._inputs[p.variable][0] for p in propositions(condition)]
        return np.asarray(self._missing[read].any(axis=0))


def _degree(variable: Variable, proposition: Proposition, x: FloatArray) -> FloatArray:
    """Return the degree of a proposition at values of its variable, none of them NaN."""
    term = variable.term(proposition.term)
    degree = KINDS[term.kind][1](x, *term.parameters)
    for hedge in reversed(proposition.hedges):
        degree = HEDGES[hedge](degree)
    return degree
