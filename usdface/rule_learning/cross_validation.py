"""Cross-validation of a fitted system.

Every fold is fitted anew, feature selection included, without the recording or the variant that it
is tested on.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.findings import Finding, finding
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.learned_system import classify, evaluate_examples, fit_system

__all__ = ["Holding", "Validation", "cross_validate", "folds", "held_out"]

Holding = Literal["recording", "variant", "none"]
# Threshold of FIT_CONFUSED, chosen by hand: share of an emotion's examples taken for another.
_CONFUSED = 0.25
_UNTESTED = (
    "{expression} was learned but could not be tested: there is no second recording or variant "
    "of it"
)


@dataclass(frozen=True, eq=False, slots=True)
class Validation:
    """Confusion matrix and margins of held-out examples.

    Attributes
    ----------
    holding : {"recording", "variant", "none"}
        The group that each fold holds out; "none" = no test was possible.
    names : tuple of str, length E
        Emotions; the last row and column of `counts` is no emotion.
    counts : (E + 1, E + 1) int64
        Examples by the emotion that they show (rows) and the one recognised (columns).
    margins : (N,) float64
        Of each example: the true emotion's output less the largest other; of a face without
        emotion: minus the largest. NaN = not tested.
    shown : tuple of str, length N
        The true emotion of each example.
    """

    holding: Holding
    names: tuple[str, ...]
    counts: IntArray
    margins: FloatArray
    shown: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, "counts", dtype=np.int64)
        freeze(self, "margins")

    @property
    def tested(self) -> int:
        """The number of tested examples."""
        return int(self.counts.sum())

    @property
    def right(self) -> int:
        """The number of recognised examples."""
        return int(np.trace(self.counts))

    @property
    def untested(self) -> tuple[str, ...]:
        """Emotions without a test: they have no second recording or variant."""
        return tuple(n for n, row in zip(self.names, self.counts, strict=False) if not row.any())

    def margins_of(self, name: str) -> FloatArray:
        """Return the margins of the tested examples of an emotion."""
        own = np.array([label == name for label in self.shown], dtype=bool)
        return np.asarray(self.margins[own & ~np.isnan(self.margins)])

    def findings(self) -> list[Finding]:
        """Return FIT_UNTESTED and FIT_CONFUSED, where they apply."""
        found = [finding("FIT_UNTESTED", name, _UNTESTED, name) for name in self.untested]
        labels = [*self.names, "no emotion"]
        for name, row in zip(self.names, self.counts, strict=False):
            for other, count in zip(labels, row.tolist(), strict=True):
                if other != name and count and count >= _CONFUSED * row.sum():
                    message = (
                        "held out, {expression} is taken for {other} in {mistaken_count} of "
                        "{example_count} examples"
                    )
                    values = name, other, count, row.sum()
                    found.append(finding("FIT_CONFUSED", name, message, *values))
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for a report."""
        labels = [*self.names, "none"]
        margins = {name: self.margins_of(name) for name in self.names}
        return {
            "held_out": self.holding,
            "tested": self.tested,
            "right": self.right,
            "confusion": {
                label: dict(zip(labels, map(int, row), strict=True))
                for label, row in zip(labels, self.counts, strict=True)
            },
            "margins": {
                name: {"mean": round(float(m.mean()), 4), "worst": round(float(m.min()), 4)}
                for name, m in margins.items()
                if m.size
            },
            "untested": list(self.untested),
        }


def held_out(examples: Examples) -> Holding:
    """Return the group to hold out: recordings if emotions occur in several, else variants."""
    choices: tuple[Holding, ...] = ("recording", "variant")
    for holding in choices:
        groups = _groups(examples, holding)
        several = [
            len({g for g, e in zip(groups, examples.emotions, strict=True) if e == name}) > 1
            for name in examples.names
        ]
        if several and 2 * sum(several) >= len(several):
            return holding
    return "none"


def folds(examples: Examples, holding: Holding) -> Iterator[BoolArray]:
    """Yield the held-out examples of each fold: (N,) bool."""
    if holding == "none":
        return
    groups = _groups(examples, holding)
    for group in dict.fromkeys(groups):
        if holding == "recording" or group[0] != NO_EMOTION:
            yield np.array([g == group for g in groups], dtype=bool)


def _groups(examples: Examples, holding: Holding) -> list[tuple[str, ...]]:
    if holding == "recording":
        return [(recording,) for recording in examples.recordings]
    return list(zip(examples.emotions, examples.variants, strict=True))


def cross_validate(
    examples: Examples,
    holding: Holding,
    fit: Callable[[Examples, Examples], tuple[FloatArray, tuple[str, ...]]] | None = None,
) -> Validation:
    """Fit without each recording or variant in turn, and evaluate the held-out examples.

    Parameters
    ----------
    examples : Examples
    holding : {"recording", "variant", "none"}
    fit : callable, optional
        From the examples to fit on and those to test to outputs (N, E) and the names of their
        columns, in place of `fit_system`: for comparison.
    """
    names = examples.names
    label = {name: i for i, name in enumerate((*names, NO_EMOTION))}
    counts = np.zeros((len(label), len(label)), dtype=np.int64)
    margins = np.full(len(examples.emotions), np.nan)
    for held_out_rows in folds(examples, holding):
        training, held = examples.subset(~held_out_rows), examples.subset(held_out_rows)
        outputs, known = (fit or _fit)(training, held)
        predicted = classify(outputs, known)
        for i, true_name, predicted_name, row in zip(
            np.flatnonzero(held_out_rows), held.emotions, predicted, outputs, strict=True
        ):
            # An emotion that is not in the training set cannot be recognised: not a test.
            if true_name in known or true_name == NO_EMOTION:
                counts[label[true_name], label[predicted_name]] += 1
                margins[i] = _margin(row, known, true_name)
    return Validation(holding, names, counts, margins, examples.emotions)


def _fit(training: Examples, held: Examples) -> tuple[FloatArray, tuple[str, ...]]:
    system = fit_system(training).system
    return evaluate_examples(system, held), system.emotions


def _margin(row: FloatArray, known: tuple[str, ...], true_name: str) -> float:
    own = np.array([name == true_name for name in known], dtype=bool)
    return float(row[own].sum() - row[~own].max(initial=0.0))
