"""The explanation of a frame as text."""

from typing import Any

__all__ = ["explanation_text"]

_RULES = 4
# A difference of two outputs that is worth a line.
_LEAST_SHOWN = 0.05


def explanation_text(facts: dict[str, Any]) -> str:
    """Return a frame's explanation (`usdface.Explanation.frame`) as lines."""
    lines = [f"frame {facts['frame']}, {facts['time_s']:g} s", _values(facts["emotions"])]
    lines += [
        f"{name} is {rules:.2f} by its rules; the classifier of the face finds "
        f"{'it' if facts['emotions'][name] > rules else 'another emotion or none'}"
        for name, rules in facts["by_rules"].items()
        if abs(facts["emotions"][name] - rules) >= _LEAST_SHOWN
    ]
    if any(facts["poses_shown"].values()):
        lines.append(f"intensity of the pose: {_values(facts['poses_shown'], least=0.005)}")
    lines += [
        f"{name} is held back: not shown in {' and '.join(regions)}"
        for name, regions in facts["held_back"].items()
    ]
    fired = [rule for rule in facts["rules"] if rule["fires"] > 0]
    lines.append("rules that fire:" if fired else "no rule fires")
    for rule in fired[:_RULES]:
        lines.append(f"{rule['fires']:.2f}  {rule['rule']}")
        lines += [f"      {_condition(each)}" for each in rule["conditions"] if each["degree"] > 0]
    if facts["closed"]:
        lines.append(f"closed: {_values(facts['closed'])}")
    lines += [
        f"{shape}: {weight['solved']:.2f} to {weight['corrected']:.2f}"
        + (f" ({weight['by']})" if weight["by"] else "")
        for shape, weight in facts["weights"].items()
    ]
    return "\n".join(lines)


def _values(named: dict[str, float], least: float = -1.0) -> str:
    return "  ".join(f"{name} {value:.2f}" for name, value in named.items() if value > least)


def _condition(part: dict[str, Any]) -> str:
    moved = "occluded" if part["mm"] is None else f"{part['mm']:+.2f} mm"
    return f"{moved}  {part['variable']} is {part['is']} {part['degree']:.2f}"
