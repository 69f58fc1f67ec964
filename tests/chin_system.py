"""A system of one rule: a chin that is lowered says joy."""

from expression_systems import expression_system

from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable

__all__ = ["chin"]


def chin(space: str, **settings: object) -> ExpressionSystem:
    term = Term("open", "ramp", (0.0, -20.0))
    variables = (
        Variable("chin_y", "input", (term,)),
        Variable("joy", "output"),
    )
    rule = parse_rule("IF chin_y IS open THEN joy IS 1")
    features = (MarkerFeature("middle_chin", "y", "signed"),)
    return expression_system(
        variables, (rule,), features, space=space, face_unit="none", **settings
    )
