"""Fit the fuzzy paper's medium points again: `python benchmarks/paper_fit.py`.

The feet and outer peaks of its terms follow its design rule; the 13 peaks of Medium are free, the
33 legible outputs are the data. Each normalisation with each AND is fitted alike: differential
evolution over the ranges of the inputs (seed 0), then a simplex. See docs/fuzzy.md.
"""

from dataclasses import replace
from typing import get_args

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import differential_evolution, minimize

from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.system import FuzzySystem, Normalisation
from usdface.papers import fuzzy_table
from usdface.rule_design.paper_system import MEDIUM, paper_system, published_cases, three_terms

TABLE, INPUTS = fuzzy_table(), published_cases().inputs
LOW, HIGH = INPUTS.min(axis=0), INPUTS.max(axis=0)


def with_medium(system: FuzzySystem, medium: np.ndarray) -> FuzzySystem:
    """Return the system with other peaks of Medium."""
    changed = [
        replace(v, terms=three_terms(float(low), float(peak), float(high)))
        for v, low, peak, high in zip(system.inputs, LOW, medium, HIGH, strict=True)
    ]
    return replace(system, variables=(*changed, *system.outputs))


def off(medium: np.ndarray, system: FuzzySystem) -> tuple[float, float]:
    """Return RMS and largest difference to the legible outputs."""
    outputs = evaluate(with_medium(system, medium), INPUTS).outputs
    difference = outputs - TABLE.published
    return float(np.sqrt(np.nanmean(difference**2))), float(np.nanmax(np.abs(difference)))


def fitted(system: FuzzySystem) -> np.ndarray:
    """Return the peaks of Medium that meet the outputs best."""
    room = 1e-6 * (HIGH - LOW)
    bounds = list(zip(LOW + room, HIGH - room, strict=True))

    def cost(medium: np.ndarray) -> float:
        return off(medium, system)[0]

    coarse = differential_evolution(cost, bounds, seed=0, maxiter=150, popsize=10, polish=False)
    return minimize(cost, coarse.x, method="Nelder-Mead", bounds=bounds, options={"maxfev": 4000}).x


def main() -> None:
    table = Table(title="33 outputs of the fuzzy paper, 13 free points")
    for column in ("normalisation", "AND", "RMS", "largest"):
        table.add_column(column, justify="right" if column in ("RMS", "largest") else "left")
    table.add_row("as it stands", "min", f"{TABLE.rms:.4f}", f"{TABLE.largest:.4f}")
    for normalisation in get_args(Normalisation):
        for and_ in ("min", "prod"):
            system = replace(paper_system().fuzzy, normalisation=normalisation, and_=and_)
            found = fitted(system)
            rms, largest = off(found, system)
            table.add_row(normalisation, and_, f"{rms:.4f}", f"{largest:.4f}")
            if (normalisation, and_) == ("all_rules", "min"):
                chosen = found
    console = Console()
    console.print(table)
    for (name, ours), peak in zip(MEDIUM.items(), chosen, strict=True):
        console.print(f"{name:20} {ours:7.4f} found again {peak:7.4f}")


if __name__ == "__main__":
    main()
