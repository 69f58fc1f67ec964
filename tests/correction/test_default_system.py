from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface import read_bind, read_rig
from usdface.correction.default_system import design
from usdface.face.bound_face import bound_face
from usdface.face.expression_poses import expressions_for
from usdface.options import CorrectionOptions
from usdface.setup.retarget_setup import RetargetSetup

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def rules() -> dict[str, frozenset[str]]:
    return rules_of(read_bind(EXAMPLES / "bind.json")[0])


def rules_of(setup: RetargetSetup) -> dict[str, frozenset[str]]:
    """Return the conditions of each emotion's rule."""
    mesh = read_rig(EXAMPLES / "head.usdc")[0].face()
    expressions, _ = expressions_for(mesh.shape_names)
    system, _, _ = design(bound_face(mesh, setup), expressions, CorrectionOptions())
    assert system is not None
    return {
        rule.consequents[0][0]: frozenset(f"{p.variable} {p.term}" for p in rule.propositions)
        for rule in system.fuzzy.rules
    }


@pytest.mark.parametrize("seed", [1, 2])
def test_the_order_of_the_markers_does_not_change_the_rules(
    rules: dict[str, frozenset[str]], seed: int
) -> None:
    setup, _ = read_bind(EXAMPLES / "bind.json")
    binding = setup.binding
    order = np.random.default_rng(seed).permutation(len(binding.markers))
    markers = tuple(binding.markers[i] for i in order)
    shuffled = replace(binding, markers=markers, points=binding.points[order], confidence=None)
    assert rules_of(replace(setup, binding=shuffled)) == rules
