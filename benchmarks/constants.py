"""What changes if a tuned constant is halved or doubled: `python benchmarks/constants.py`.

The constants are those that docs/constants.md lists for rule design and rule learning.

* Rule design: systems are designed anew for the eight layouts of `benchmarks/expressions.py`, and
  evaluated without noise and without a solve. Printed are the rules that differ, the largest
  distance of an output to the intensity on each expression from 0 to 100 %, the blend shapes that
  alone give an emotion more than 0.1, and the share of expressions with one more movement that
  give another emotion more than 0.35.
* Rule learning: worlds of `benchmarks/fuzzy_variants.py` are fitted anew. Printed are the rules
  that differ, and the examples recognised of new performers and of new variants.
"""

import argparse
import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from face_answers import loudest_alone, others_heard  # noqa: E402
from faces import FACES, make_face  # noqa: E402
from fuzzy_variants import variants_face, world  # noqa: E402

from usdface.correction.expression_layer import design  # noqa: E402
from usdface.options import CorrectionOptions  # noqa: E402
from usdface.rule_learning.cross_validation import cross_validate  # noqa: E402
from usdface.rule_learning.learned_system import fit_system  # noqa: E402

DESIGN = {
    "rule_design.feature_selection": (
        "_LEAST_SIGNAL", "_DEAD_ZONE", "_TOP", "_CONDITIONS", "_SHORTLIST", "_PAIRED",
        "_OTHER_EXPRESSION", "_SINGLE_MOVEMENT", "_COMBINED_MOVEMENTS", "_WORST", "_NOISE_COST", "_LEAST_GAIN",
        "_HALF_MOVES",
    ),
    "rule_design.negative_conditions": ("LEAST_FIRING", "_CLEAR", "_BEGIN", "_END"),
    "rule_design.marker_roles": ("_MIDLINE",),
}  # fmt: skip
LEARNING = {
    "rule_learning.terms": (
        "_DEAD_ZONE", "_LEAST_SIGNAL", "_LEAST_DEAD_ZONE", "_TOP", "_QUANTILE", "_DISTINCT",
    ),
    "rule_learning.training_set": ("_NOISE_COST", "_ALIKE", "LEAST_SIGNAL"),
    "rule_learning.rules": (
        "_CONDITIONS", "_MOST_RULES", "_PART_COST", "_BEAM", "_MOVEMENTS", "_WORST_MOVEMENT",
        "_COVERED", "_VARIANT_COVERED", "_WORTHWHILE",
    ),
    "rule_learning.fallback_rules": (
        "_MOST_RULES", "_PARTS", "_PARTIAL", "_MOVED", "_MOVEMENTS", "_LARGEST_NONE",
        "_LARGEST_MOVEMENT", "_CONDITION_COST", "_NOISE_COST", "_OWN", "_OTHERS", "_LEAST_MET",
        "_TOGETHER", "_SHORTLIST",
    ),
}  # fmt: skip
# Shares whose double would be beyond 1: what is left to 1 is halved and doubled.
SHARES = {"_TOP", "_ALIKE", "_TOGETHER", "_WORTHWHILE", "_VARIANT_COVERED"}
Rules = frozenset[tuple[object, ...]]


@contextmanager
def changed(module: str, name: str, factor: float) -> Iterator[float]:
    """Multiply a constant in every module that has it."""
    value = getattr(importlib.import_module(f"usdface.{module}"), name)
    other = 1 - (1 - value) * factor if name in SHARES else value * factor
    other = max(1, round(other)) if isinstance(value, int) else other
    package = f"usdface.{module.split('.')[0]}."
    private = name.startswith("_")
    homes = [f"usdface.{module}"] if private else [m for m in sys.modules if m.startswith(package)]
    modules = [sys.modules[m] for m in homes if hasattr(sys.modules[m], name)]
    for home in modules:
        setattr(home, name, other)
    try:
        yield other
    finally:
        for home in modules:
            setattr(home, name, value)


def designed(kinds: list[str]) -> Callable[[], tuple[Rules, str]]:
    faces = {kind: make_face(kind, SHARED) for kind in kinds}
    amounts = np.linspace(0, 1, 21)

    def measured() -> tuple[Rules, str]:
        rules, off, alone, other = set(), 0.0, 0, []
        for kind, face in faces.items():
            system, setup, _ = design(face.mesh, face.setup, face.expressions, CorrectionOptions())
            assert system is not None
            setup = replace(setup, neutral=face.setup.neutral, head=face.setup.head)
            judged = replace(face, system=system, setup=setup)
            rules |= {(kind, rule.text) for rule in system.fuzzy.rules}
            poses = (amounts[:, None, None] * face.poses).reshape(-1, len(face.mesh.shapes))
            outputs = judged.hear(poses)
            shown = (amounts[:, None, None] * np.eye(len(face.poses))).reshape(outputs.shape)
            off = max(off, float(np.abs(outputs - shown).max()))
            alone += len(loudest_alone(judged))
            other.append((others_heard(judged) > 0.35).mean())
        varied = f"{100 * np.mean(other):.1f} % of varied expressions"
        return frozenset(rules), f"off by {off:.3f}, {alone} blend shapes alone, {varied}"

    return measured


def learned(worlds: list[int], rules_only: bool) -> Callable[[], tuple[Rules, str]]:
    face = variants_face()

    def measured() -> tuple[Rules, str]:
        rules, right = set(), np.zeros(2, dtype=int)
        for seed in worlds:
            data = world(seed, face)
            system = fit_system(data).system
            rules |= {(seed, rule.text, rule.weight) for rule in system.fuzzy.rules}
            if rules_only:
                continue
            tests = (cross_validate(data, "recording"), cross_validate(data, "variant"))
            right += [int(np.trace(test.counts[:-1])) for test in tests]
        recognised = f"new performers {right[0]}, new variants {right[1]}"
        return frozenset(rules), "" if rules_only else recognised

    return measured


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=("design", "learning"))
    parser.add_argument("--faces", nargs="+", choices=FACES, default=list(FACES))
    parser.add_argument("--worlds", nargs="+", type=int, default=[0, 1])
    parser.add_argument("--rules-only", action="store_true", help="no cross-validation: quicker")
    told = parser.parse_args()
    for what, table, prepare in (
        ("design", DESIGN, partial(designed, told.faces)),
        ("learning", LEARNING, partial(learned, told.worlds, told.rules_only)),
    ):
        if told.only not in (None, what):
            continue
        measured = prepare()
        known, figures = measured()
        print(f"{what}: {len(known)} rules, {figures}", flush=True)
        for module, names in table.items():
            for name in names:
                for factor in (0.5, 2.0):
                    with changed(module, name, factor) as value:
                        rules, figures = measured()
                    differ = len(known - rules)
                    print(f"{module}.{name} {value:g}: {differ} rules, {figures}", flush=True)


if __name__ == "__main__":
    main()
