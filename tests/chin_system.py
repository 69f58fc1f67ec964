"""A system of one rule: a chin that is lowered says joy."""

from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import FuzzySystem, Term, Variable

__all__ = ["chin"]


def chin(space: str, **settings: object) -> FuzzySystem:
    term = Term("open", "ramp", (0.0, -20.0))
    variables = (
        Variable("chin_y", "input", "middle_chin", "y", "signed", (term,)),
        Variable("joy", "output"),
    )
    rule = parse_rule("IF chin_y IS open THEN joy IS 1")
    return FuzzySystem(variables, (rule,), space=space, face_unit="none", **settings)  # type: ignore[arg-type]
