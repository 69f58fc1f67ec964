"""The fuzzy system: input and output variables, their terms, and the rule base."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal, get_args

from usdface.errors import InputError
from usdface.fuzzy.membership import CONSEQUENTS, check_parameters
from usdface.fuzzy.rules import KEYWORDS, Rule
from usdface.options import BLEND_TIME, FEATURE_SMOOTHING, RESPONSE, CorrectionMode

__all__ = [
    "Aggregation",
    "And",
    "Axis",
    "Defuzzifier",
    "FaceUnit",
    "FuzzySystem",
    "Inference",
    "Measure",
    "Normalisation",
    "Or",
    "Sampling",
    "Space",
    "Term",
    "Variable",
    "VariableKind",
    "check_counts",
]

VariableKind = Literal["input", "output"]
Axis = Literal["x", "y", "z"]
Measure = Literal["absolute", "signed"]
Normalisation = Literal["per_output", "all_rules", "weighted_sum"]
And = Literal["min", "prod", "lukasiewicz", "hamacher", "einstein", "drastic", "nilpotent"]
Or = Literal["max", "probor", "lukasiewicz", "hamacher", "einstein", "drastic", "nilpotent"]
Aggregation = Literal[Or, "sum"]
Inference = Literal["sugeno", "mamdani"]
Defuzzifier = Literal["centroid", "bisector", "mean_of_max", "smallest_of_max", "largest_of_max"]
Sampling = Literal["ends", "middles"]
Space = Literal["take", "character"]
FaceUnit = Literal["none", "marker_spread"]


# More would only cost time: the centroid changes by less than 1e-6 of the range.
_MOST_SAMPLES = 10_000
# No expression is left of what is smoothed longer.
_LONGEST_SMOOTHING = 10.0
# Nobody reads more, and how far each fires is kept for every frame.
_MOST_RULES = 10_000
_MOST_VARIABLES = _MOST_TERMS = 1_000


def _check_choice(what: str, value: object, choices: Any) -> None:
    if value not in get_args(choices):
        raise InputError(f"{what} is {value!r}; expected {' or '.join(get_args(choices))}")


def check_counts(variables: int = 0, terms: int = 0, rules: int = 0) -> None:
    """Refuse more variables, terms of one of them or rules than anybody reads.

    Raises
    ------
    InputError
        With the number and the most.
    """
    counts = (
        ("variables", variables, _MOST_VARIABLES),
        ("terms of one variable", terms, _MOST_TERMS),
        ("rules", rules, _MOST_RULES),
    )
    for what, count, most in counts:
        if count > most:
            raise InputError(f"the fuzzy system has {count} {what}; expected at most {most}")


def _check_unique(what: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"{what} {name!r} occurs twice; names must be unique")
        seen.add(name)


@dataclass(frozen=True, slots=True)
class Term:
    """One linguistic value of a variable: a membership function with a name.

    Of a Sugeno system's output it is a "constant", or "linear": a factor for each input, in
    their order, then the constant.
    """

    name: str
    kind: str
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(map(float, self.parameters)))
        odd = self.name[:1] == "(" or self.name.count(")") > self.name.count("(")
        if odd or self.name.split() != [self.name] or self.name.upper() in KEYWORDS:
            raise InputError(f"a term cannot be called {self.name!r}; rules need a single word")
        try:
            check_parameters(self.kind, self.parameters)
        except InputError as error:
            raise InputError(f"term {self.name!r}: {error}") from None


@dataclass(frozen=True, slots=True)
class Variable:
    """An input (a feature of the face) or an output (an emotion).

    Attributes
    ----------
    name : str
        An identifier; rules use it.
    kind : {"input", "output"}
    role, axis, measure : str
        Input only, see `usdface.correction.features`: the marker's role; the axis along which its
        distance to the nose tip is taken; "absolute" or "signed" difference to neutral.
    terms : tuple of Term
        An output needs none where its rules give numbers.
    range : (low, high), optional
        An output's answers stay in it: [0, 1] where there is none. Of an input it says which
        values its terms should cover; what lies outside is not cut off.
    default : float
        Output only: its answer where nothing fires.
    """

    name: str
    kind: VariableKind
    role: str = ""
    axis: Axis = "y"
    measure: Measure = "signed"
    terms: tuple[Term, ...] = ()
    range: tuple[float, float] | None = None
    default: float = 0.0

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name.upper() in KEYWORDS:
            raise InputError(f"a fuzzy variable cannot be called {self.name!r}")
        where = f"fuzzy variable {self.name!r}"
        _check_choice(f"{where}: kind", self.kind, VariableKind)
        _check_choice(f"{where}: axis", self.axis, Axis)
        _check_choice(f"{where}: measure", self.measure, Measure)
        check_counts(terms=len(self.terms))
        _check_unique(f"{where}: term", (term.name for term in self.terms))
        if self.kind == "input" and not self.role:
            raise InputError(f"{where} is an input without a role; name the marker's role")
        object.__setattr__(self, "default", float(self.default))
        if self.range is not None:
            object.__setattr__(self, "range", tuple(map(float, self.range)))
            if not (all(map(isfinite, self.range)) and self.range[0] < self.range[1]):
                raise InputError(f"{where}: range {self.range}; expected a lower, then a higher")
        low, high = self.span
        if self.kind == "output" and not low <= self.default <= high:
            raise InputError(f"{where}: default {self.default} lies outside {low:g} to {high:g}")

    @property
    def span(self) -> tuple[float, float]:
        """The range, or [0, 1] where there is none."""
        return self.range or (0.0, 1.0)

    def term(self, name: str) -> Term:
        """Return the term of that name (the system has checked that its rules' exist)."""
        return next(term for term in self.terms if term.name == name)


@dataclass(frozen=True, slots=True)
class FuzzySystem:
    """A Sugeno or Mamdani system that reads a face and answers emotions in [0, 1].

    Attributes
    ----------
    variables : tuple of Variable
        Inputs and outputs; their order is that of the columns in `usdface.fuzzy.inference`.
    rules : tuple of Rule
    normalisation : {"all_rules", "per_output", "weighted_sum"}
        Sugeno only: the rules whose firing strengths are the denominator of an output: all, its
        own, or none.
    and_ : key of `usdface.fuzzy.norms.T_NORMS`
    space : {"take", "character"}
        Where features are measured: on the performer's markers or on the character's.
    face_unit : {"none", "marker_spread"}
        What features are divided by: "none" leaves them in millimetres.
    neutral_rule : bool
        Adds a rule that fires as far as no other does and says each output's default.
    mode, gain
        How the emotions are blended over the weights, see `usdface.correction.pose_blend`.
    or_ : key of `usdface.fuzzy.norms.S_NORMS`
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
    response : (onset, full)
        Outputs at which a raised pose begins to show and shows whole, see
        `usdface.correction.pose_blend.respond`.
    smoothing : float [s]
        How far noisy features are smoothed over time, see `usdface.correction.features.smooth`.
    blend_time : float [s]
        How long a raised pose comes and goes, see `usdface.correction.temporal_blend.blended`.
    ease : float
        How far the antagonists of what is raised go back, 0 to 1, see
        `usdface.correction.pose_blend.eased`.

    Raises
    ------
    InputError
        If a rule names something that is not there, or a setting is not one of its choices.
    """

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    normalisation: Normalisation = "all_rules"
    and_: And = "min"
    space: Space = "character"
    face_unit: FaceUnit = "marker_spread"
    neutral_rule: bool = True
    mode: CorrectionMode = "raise"
    gain: float = 1.0
    or_: Or = "max"
    inference: Inference = "sugeno"
    implication: And = "min"
    aggregation: Aggregation = "max"
    defuzzifier: Defuzzifier = "centroid"
    samples: int = 101
    sampling: Sampling = "ends"
    response: tuple[float, float] = RESPONSE
    smoothing: float = FEATURE_SMOOTHING
    blend_time: float = BLEND_TIME
    ease: float = 0.0

    def __post_init__(self) -> None:
        _check_choice("normalisation of the fuzzy system", self.normalisation, Normalisation)
        _check_choice("AND of the fuzzy system", self.and_, And)
        _check_choice("OR of the fuzzy system", self.or_, Or)
        _check_choice("inference of the fuzzy system", self.inference, Inference)
        _check_choice("implication of the fuzzy system", self.implication, And)
        _check_choice("aggregation of the fuzzy system", self.aggregation, Aggregation)
        _check_choice("defuzzifier of the fuzzy system", self.defuzzifier, Defuzzifier)
        _check_choice("sampling of the fuzzy system", self.sampling, Sampling)
        _check_choice("space of the fuzzy system", self.space, Space)
        _check_choice("face unit of the fuzzy system", self.face_unit, FaceUnit)
        _check_choice("mode of the fuzzy system", self.mode, CorrectionMode)
        if not (isfinite(self.gain) and self.gain >= 0):
            raise InputError(f"gain of the fuzzy system is {self.gain}; expected 0 or more")
        self._check_correction()
        if not 2 <= self.samples <= _MOST_SAMPLES:
            raise InputError(
                f"the fuzzy system has {self.samples} samples; expected 2 to {_MOST_SAMPLES}"
            )
        check_counts(variables=len(self.variables), rules=len(self.rules))
        _check_unique("fuzzy variable", (v.name for v in self.variables))
        for variable in self.variables:
            self._check_terms(variable)
        terms = {v.name: [t.name for t in v.terms] for v in self.inputs}
        for rule in self.rules:
            self._check_rule(rule, terms)

    def _check_correction(self) -> None:
        try:
            onset, full = map(float, self.response)
        except (TypeError, ValueError):
            onset = full = -1.0
        if not (isfinite(full) and 0 <= onset < full):
            raise InputError(
                f"response of the fuzzy system is {self.response!r}; expected an output of 0 or "
                "more, then a larger one"
            )
        object.__setattr__(self, "response", (onset, full))
        for name, seconds in (("smoothing", self.smoothing), ("blend time", self.blend_time)):
            if not 0 <= seconds <= _LONGEST_SMOOTHING:
                raise InputError(
                    f"{name} of the fuzzy system is {seconds:g}; expected seconds, 0 to "
                    f"{_LONGEST_SMOOTHING:g}"
                )
        if not 0 <= self.ease <= 1:
            raise InputError(f"ease of the fuzzy system is {self.ease}; expected 0 to 1")

    def _check_rule(self, rule: Rule, terms: dict[str, list[str]]) -> None:
        for variable, term in rule.antecedent:
            if variable in self.emotions:
                raise InputError(
                    f"{rule.named}: {variable!r} is an output; a rule asks for inputs alone, "
                    f"{', '.join(terms) or 'of which there are none'}"
                )
            if variable not in terms:
                raise InputError(
                    f"{rule.named}: no input is called {variable!r}; there are "
                    f"{', '.join(terms) or 'none'}; correct the rule, or add the input"
                )
            if term not in terms[variable]:
                raise InputError(
                    f"{rule.named}: {variable} has no term {term!r}; "
                    f"it has {', '.join(terms[variable]) or 'none'}; "
                    "correct the rule, or add the term"
                )
        for output, value in rule.consequents:
            if output not in self.emotions:
                raise InputError(
                    f"{rule.named}: no output is called {output!r}; there are "
                    f"{', '.join(self.emotions) or 'none'}; correct the rule, or add the output"
                )
            self._check_conclusion(rule, self._output(output), value)
        _check_unique(f"{rule.named}: output", (output for output, _ in rule.consequents))

    def _check_conclusion(self, rule: Rule, output: Variable, value: float | str) -> None:
        named = [term.name for term in output.terms]
        if isinstance(value, str) and value not in named:
            raise InputError(
                f"{rule.named}: {output.name} has no term {value!r}; "
                f"give it a number, or one of {', '.join(named) or 'none'}"
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
                what = "constant or linear" if numbers else "a membership function"
                raise InputError(
                    f"{where} is {term.kind}; a term of an {variable.kind} of a "
                    f"{self.inference} system is {what}"
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
    def emotions(self) -> tuple[str, ...]:
        """Names of the output variables, in the order of the columns that `evaluate` gives."""
        return tuple(v.name for v in self.outputs)
