"""The rules of a page: how far each fires, and the degree of each of its conditions, over time."""

from typing import Any

import numpy as np

from usdface.page.packed_data import Quantized
from usdface.rule_design.marker_roles import known_roles
from usdface.shot.played_shot import PlayedShot

__all__ = ["rule_data"]


def rule_data(played: PlayedShot) -> dict[str, Any] | None:
    """Return the rules of a shot's fuzzy system for a page; None where no layer has their inputs.

    Degrees are evaluated on the inputs that the express layer holds.
    """
    evaluation, system = played.evaluation(), played.shot.system
    if evaluation is None or system is None:
        return None
    rules = system.fuzzy.rules
    conditions = list(dict.fromkeys(p for rule in rules for p in rule.propositions))
    number = {condition: i for i, condition in enumerate(conditions)}
    inputs = [variable.name for variable in system.fuzzy.inputs]
    markers = known_roles(played.shot.setup.binding.markers, played.shot.setup.roles)
    degrees = np.array([evaluation.memberships[c] for c in conditions])
    firing = played.firing if len(played.firing) else evaluation.firing
    return {
        "rules": [
            {
                "text": " ".join(rule.text.split()),
                "then": [name for name, _ in rule.consequents],
                "weight": rule.weight,
                "enabled": rule.enabled,
                "conditions": [number[p] for p in rule.propositions],
            }
            for rule in rules
        ],
        "conditions": [
            {
                "variable": c.variable,
                "marker": markers.get(system.features[inputs.index(c.variable)].role, ""),
                "axis": system.features[inputs.index(c.variable)].axis,
                "term": " ".join((*c.hedges, c.term)),
                "input": inputs.index(c.variable),
            }
            for c in conditions
        ],
        "firing": Quantized(firing, 8),
        "degrees": Quantized(degrees.reshape(len(conditions), -1).T, 8),
        "inputs_mm": Quantized(1000.0 * played.unit * played.inputs),
    }
