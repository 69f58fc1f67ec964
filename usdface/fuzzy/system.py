"""The fuzzy system: input and output variables, their terms, and the rule base."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal, get_args

from usdface.errors import InputError
from usdface.fuzzy.membership import check_parameters
from usdface.fuzzy.rules import KEYWORDS, Rule
from usdface.options import CorrectionMode

__all__ = [
    "And",
    "Axis",
    "FaceUnit",
    "FuzzySystem",
    "Measure",
    "Normalisation",
    "Space",
    "Term",
    "Variable",
    "VariableKind",
]

VariableKind = Literal["input", "output"]
Axis = Literal["x", "y", "z"]
Measure = Literal["absolute", "signed"]
Normalisation = Literal["per_output", "all_rules"]
And = Literal["min", "prod"]
Space = Literal["take", "character"]
FaceUnit = Literal["none", "marker_spread"]


def _check_choice(what: str, value: object, choices: Any) -> None:
    if value not in get_args(choices):
        raise InputError(f"{what} is {value!r}; expected {' or '.join(get_args(choices))}")


def _check_unique(what: str, names: Iterable[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"{what} {name!r} occurs twice; names must be unique")
        seen.add(name)


@dataclass(frozen=True, slots=True)
class Term:
    """One linguistic value of a variable: a membership function with a name."""

    name: str
    kind: str
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(map(float, self.parameters)))
        if self.name.split() != [self.name] or self.name.upper() in KEYWORDS:
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
        Input only, see `usdface.fuzzy.features`: the marker's role; the axis along which its
        distance to the nose tip is taken; "absolute" or "signed" difference to neutral.
    terms : tuple of Term
        Input only.
    """

    name: str
    kind: VariableKind
    role: str = ""
    axis: Axis = "y"
    measure: Measure = "signed"
    terms: tuple[Term, ...] = ()

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name.upper() in KEYWORDS:
            raise InputError(f"a fuzzy variable cannot be called {self.name!r}")
        where = f"fuzzy variable {self.name!r}"
        _check_choice(f"{where}: kind", self.kind, VariableKind)
        _check_choice(f"{where}: axis", self.axis, Axis)
        _check_choice(f"{where}: measure", self.measure, Measure)
        _check_unique(f"{where}: term", (term.name for term in self.terms))
        if self.kind == "input" and not self.role:
            raise InputError(f"{where} is an input without a role; name the marker's role")

    def term(self, name: str) -> Term:
        """Return the term of that name (the system has checked that its rules' exist)."""
        return next(term for term in self.terms if term.name == name)


@dataclass(frozen=True, slots=True)
class FuzzySystem:
    """A zero-order Sugeno system that reads a face and answers emotions in [0, 1].

    Attributes
    ----------
    variables : tuple of Variable
        Inputs and outputs; their order is that of the columns in `usdface.fuzzy.inference`.
    rules : tuple of Rule
    normalisation : {"all_rules", "per_output"}
        The rules whose firing strengths are the denominator of an output: all, or its own.
    and_ : {"min", "prod"}
    space : {"take", "character"}
        Where features are measured: on the performer's markers or on the character's.
    face_unit : {"none", "marker_spread"}
        What features are divided by: "none" leaves them in millimetres.
    neutral_rule : bool
        Adds a silent rule that fires as far as no other does.
    mode, gain
        How the emotions are blended over the weights, see `usdface.fuzzy.correct`.

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

    def __post_init__(self) -> None:
        _check_choice("normalisation of the fuzzy system", self.normalisation, Normalisation)
        _check_choice("AND of the fuzzy system", self.and_, And)
        _check_choice("space of the fuzzy system", self.space, Space)
        _check_choice("face unit of the fuzzy system", self.face_unit, FaceUnit)
        _check_choice("mode of the fuzzy system", self.mode, CorrectionMode)
        if not (isfinite(self.gain) and self.gain >= 0):
            raise InputError(f"gain of the fuzzy system is {self.gain}; expected 0 or more")
        _check_unique("fuzzy variable", (v.name for v in self.variables))
        terms = {v.name: [t.name for t in v.terms] for v in self.inputs}
        for rule in self.rules:
            self._check_rule(rule, terms)

    def _check_rule(self, rule: Rule, terms: dict[str, list[str]]) -> None:
        for variable, term in rule.antecedent:
            if variable not in terms:
                raise InputError(
                    f"rule {rule}: no input is called {variable!r}; "
                    f"there are {', '.join(terms) or 'none'}"
                )
            if term not in terms[variable]:
                raise InputError(
                    f"rule {rule}: {variable} has no term {term!r}; "
                    f"it has {', '.join(terms[variable]) or 'none'}"
                )
        for output, value in rule.consequents:
            if output not in self.emotions:
                raise InputError(
                    f"rule {rule}: no output is called {output!r}; "
                    f"there are {', '.join(self.emotions) or 'none'}"
                )
            if not 0 <= value <= 1:
                raise InputError(f"rule {rule}: {output} IS {value:g}; expected 0 to 1")
        _check_unique(f"rule {rule}: output", (output for output, _ in rule.consequents))

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """Input variables, in the order of the columns that `evaluate` takes."""
        return tuple(v for v in self.variables if v.kind == "input")

    @property
    def emotions(self) -> tuple[str, ...]:
        """Names of the output variables, in the order of the columns that `evaluate` gives."""
        return tuple(v.name for v in self.variables if v.kind == "output")
