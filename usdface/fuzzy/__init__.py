"""A fuzzy inference engine: variables, a rule base, Sugeno and Mamdani inference, lint.

It stands alone: of usdface it imports arrays, errors and findings only, and knows no faces.
All is immutable, and whole arrays of samples are evaluated at once.

Examples
--------
The tipper of MATLAB's Fuzzy Logic Toolbox: service and food from 0 to 10, the tip in per cent.

>>> import numpy as np
>>> from usdface.fuzzy import FuzzySystem, Term, Variable, evaluate, parse_rule
>>> service = Variable("service", "input", (
...     Term("poor", "gaussian", (0, 1.5)),
...     Term("good", "gaussian", (5, 1.5)),
...     Term("excellent", "gaussian", (10, 1.5)),
... ), range=(0, 10))
>>> food = Variable("food", "input", (
...     Term("rancid", "trapezoidal", (0, 0, 1, 3)),
...     Term("delicious", "trapezoidal", (7, 9, 10, 10)),
... ), range=(0, 10))
>>> tip = Variable("tip", "output", (
...     Term("cheap", "triangular", (0, 5, 10)),
...     Term("average", "triangular", (10, 15, 20)),
...     Term("generous", "triangular", (20, 25, 30)),
... ), range=(0, 30))
>>> rules = (
...     parse_rule("IF service IS poor OR food IS rancid THEN tip IS cheap"),
...     parse_rule("IF service IS good THEN tip IS average"),
...     parse_rule("IF service IS excellent OR food IS delicious THEN tip IS generous"),
... )
>>> tipper = FuzzySystem((service, food, tip), rules, inference="mamdani")
>>> evaluation = evaluate(tipper, np.array([[2, 1], [4, 5], [7, 8]]))
>>> evaluation.outputs.round(4).tolist()
[[7.0169], [14.4585], [20.3414]]
>>> evaluation.firing.round(2).tolist()
[[1.0, 0.14, 0.0], [0.03, 0.8, 0.0], [0.0, 0.41, 0.5]]
"""

from usdface.fuzzy.inference import Evaluation, evaluate, rules_firing_at
from usdface.fuzzy.lint import rule_findings
from usdface.fuzzy.membership import membership
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

__all__ = [
    "Evaluation",
    "FuzzySystem",
    "Rule",
    "Term",
    "Variable",
    "evaluate",
    "membership",
    "parse_rule",
    "rule_findings",
    "rules_firing_at",
]
