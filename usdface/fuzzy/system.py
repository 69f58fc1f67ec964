"""The fuzzy system: input and output variables, the rule base, and the settings of inference."""

from dataclasses import dataclass
from typing import Literal

from usdface.errors import InputError, did_you_mean
from usdface.fuzzy.membership import CONSEQUENTS
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Variable, check_choice, check_counts, check_unique

__all__ = [
    "Aggregation",
    "And",
    "Defuzzifier",
    "FuzzySystem",
    "Inference",
    "Normalisation",
    "Or",
    "Sampling",
]

Normalisation = Literal["per_output", "all_rules", "weighted_sum"]
And = Literal["min", "prod", "lukasiewicz", "hamacher", "einstein", "drastic", "nilpotent"]
Or = Literal["max", "probor", "lukasiewicz", "hamacher", "einstein", "drastic", "nilpotent"]
Aggregation = Literal[Or, "sum"]
Inference = Literal["sugeno", "mamdani"]
Defuzzifier = Literal["centroid", "bisector", "mean_of_max", "smallest_of_max", "largest_of_max"]
Sampling = Literal["ends", "middles"]

# More would only cost time: the centroid changes by less than 1e-6 of the range.
_MOST_SAMPLES = 10_000


@dataclass(frozen=True, slots=True)
class FuzzySystem:
    """A Sugeno or Mamdani system: variables, a rule base, and how its rules are evaluated.

    Attributes
    ----------
    variables : tuple of Variable
        Inputs and outputs; their order is that of the columns in `usdface.fuzzy.inference`.
    rules : tuple of Rule
    normalisation : {"per_output", "all_rules", "weighted_sum"}
        Sugeno only: the rules whose firing strengths are the denominator of an output: its own,
        all, or none.
    and_ : key of `usdface.fuzzy.norms.T_NORMS`
    or_ : key of `usdface.fuzzy.norms.S_NORMS`
    else_rule : bool
        Adds a rule that fires as far as no other does, 1 - max firing strength, and concludes
        with each output's default.
    inference : {"sugeno", "mamdani"}
    implication, aggregation : keys of `T_NORMS` and `AGGREGATIONS`
        Mamdani only: how a rule cuts its conclusion's term, and how the cut terms are joined.
    defuzzifier : str
        Mamdani only.
    samples : int
        Mamdani only: values of an output at which its set is sampled.
    sampling : {"ends", "middles"}
        Mamdani only: at the range's ends and evenly between, as MATLAB does, or in the middle of
        equal intervals, as fuzzylite does.

    Raises
    ------
    InputError
        If a rule names something that is not there, or a setting is not one of its choices.

    Examples
    --------
    >>> from usdface.fuzzy import Term, Variable, parse_rule
    >>> load = Variable("load", "input", (Term("high", "ramp", (0.5, 1.0)),))
    >>> rule = parse_rule("IF load IS high THEN alarm IS 1")
    >>> usdface.FuzzySystem((load, Variable("alarm", "output")), (rule,)).inference
    'sugeno'
    """

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    normalisation: Normalisation = "per_output"
    and_: And = "min"
    or_: Or = "max"
    else_rule: bool = False
    inference: Inference = "sugeno"
    implication: And = "min"
    aggregation: Aggregation = "max"
    defuzzifier: Defuzzifier = "centroid"
    samples: int = 101
    sampling: Sampling = "ends"

    def __post_init__(self) -> None:
        check_choice("normalisation of the fuzzy system", self.normalisation, Normalisation)
        check_choice("AND of the fuzzy system", self.and_, And)
        check_choice("OR of the fuzzy system", self.or_, Or)
        check_choice("inference of the fuzzy system", self.inference, Inference)
        check_choice("implication of the fuzzy system", self.implication, And)
        check_choice("aggregation of the fuzzy system", self.aggregation, Aggregation)
        check_choice("defuzzifier of the fuzzy system", self.defuzzifier, Defuzzifier)
        check_choice("sampling of the fuzzy system", self.sampling, Sampling)
        if not 2 <= self.samples <= _MOST_SAMPLES:
            raise InputError(
                f"the fuzzy system has {self.samples} samples; expected 2 to {_MOST_SAMPLES}"
            )
        check_counts(variables=len(self.variables), rules=len(self.rules))
        check_unique("fuzzy variable", (v.name for v in self.variables))
        for variable in self.variables:
            self._check_terms(variable)
        terms = {v.name: [t.name for t in v.terms] for v in self.inputs}
        for rule in self.rules:
            self._check_rule(rule, terms)

    def _check_rule(self, rule: Rule, terms: dict[str, list[str]]) -> None:
        for proposition in rule.propositions:
            variable, term = proposition.variable, proposition.term
            if variable in self.output_names:
                raise InputError(
                    f"{rule.named}: {variable!r} is an output; a rule asks for inputs alone, "
                    f"{', '.join(terms) or 'of which there are none'}"
                )
            if variable not in terms:
                raise InputError(
                    f"{rule.named}: no input is called {variable!r}; there are "
                    f"{', '.join(terms) or 'none'}; correct the rule, or add the input"
                    f"{did_you_mean(variable, terms)}"
                )
            if term not in terms[variable]:
                raise InputError(
                    f"{rule.named}: {variable} has no term {term!r}; "
                    f"it has {', '.join(terms[variable]) or 'none'}; "
                    "correct the rule, or add the term"
                )
        for output, value in rule.consequents:
            if output not in self.output_names:
                raise InputError(
                    f"{rule.named}: no output is called {output!r}; there are "
                    f"{', '.join(self.output_names) or 'none'}; correct the rule, or add the output"
                )
            self._check_conclusion(rule, self._output(output), value)
        check_unique(f"{rule.named}: output", (output for output, _ in rule.consequents))

    def _check_conclusion(self, rule: Rule, output: Variable, value: float | str) -> None:
        named = [term.name for term in output.terms]
        if isinstance(value, str) and value not in named:
            raise InputError(
                f"{rule.named}: {output.name} has no term {value!r}; "
                f"give it a number{', or one of ' + ', '.join(named) if named else ''}"
            )
        if isinstance(value, str):
            return
        if self.inference == "mamdani":
            raise InputError(
                f"{rule.named}: {output.name} IS {value:g}, but the inference is mamdani; "
                f"conclude with one of its terms, {', '.join(named) or 'none'}"
            )
        low, high = output.span
        if not low <= value <= high:
            raise InputError(
                f"{rule.named}: {output.name} IS {value:g}; expected {low:g} to {high:g}"
            )

    def _output(self, name: str) -> Variable:
        return next(v for v in self.outputs if v.name == name)

    def _check_terms(self, variable: Variable) -> None:
        numbers = variable.kind == "output" and self.inference == "sugeno"
        for term in variable.terms:
            where = f"fuzzy variable {variable.name!r}: term {term.name!r}"
            if (term.kind in CONSEQUENTS) != numbers:
                expected = "constant or linear" if numbers else "a membership function"
                raise InputError(
                    f"{where} is {term.kind}; a term of an {variable.kind} of a "
                    f"{self.inference} system is {expected}"
                )
            wanted = len(self.inputs) + 1
            if term.kind == "linear" and len(term.parameters) != wanted:
                raise InputError(
                    f"{where} has {len(term.parameters)} parameters; expected {wanted}: "
                    "a factor for each input and a constant"
                )

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """Input variables, in the order of the columns that `evaluate` takes."""
        return tuple(v for v in self.variables if v.kind == "input")

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """Output variables, in the order of the columns that `evaluate` gives."""
        return tuple(v for v in self.variables if v.kind == "output")

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the output variables, in the order of the columns that `evaluate` gives."""
        return tuple(v.name for v in self.outputs)
