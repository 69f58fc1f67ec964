"""The default fuzzy system, designed from a rig's own expression poses.

No recording is needed. For each expression a few features are picked that move well above
the noise in its pose and, taken together, in none of the other poses and in no single blend
shape. A feature's term is a ramp: 0 up to a dead zone around neutral, 1 from its value at the
pose on. Features are signed, so no rule fires on a neutral face, and since blend shapes are
linear, a pose at half its strength fires its rule by about a half.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.fuzzy.features import marker_spread
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import Axis, FuzzySystem, Term, Variable
from usdface.setup import Expression
from usdface.takes import FloatArray, IntArray

__all__ = ["design_system"]

_AXES: tuple[Axis, ...] = ("x", "y", "z")
# What the names of a shape on either side differ in: mouthSmileLeft, mouthSmile_L, eye-left-slit.
_SIDE = re.compile(r"(?i)left|right|(?<=[_.\- ])[lr]$|^[lr](?=[_.\- ])")
# A feature is a difference of two markers; all limits are in standard deviations of its noise.
_DEAD_ZONE = 0.8
_LEAST_SIGNAL = 4.0
# A dead zone of at least this share of the value at the pose, for markers without noise.
_LEAST_DEAD_ZONE = 0.05
# Nor does a feature that stays below this [m] count, however quiet the markers are.
_LEAST_MOTION = 1e-6
_CONDITIONS = 4
# Candidates of which all pairs are tried.
_SHORTLIST = 80
# Movements, the largest first, that are also tried two at a time.
_PAIRED = 100
# Costs of a full false firing: by another expression's pose, and by all movements together.
_OTHER_EXPRESSION = 20.0
_MOVEMENT = 40.0
# Cost of a feature whose signal is as small as its noise.
_NOISE_COST = 30.0
# An additional condition has to take away this share of the cost.
_LEAST_GAIN = 0.02
# Expressions that fire another's rule further than this cannot be told apart.
_CONFUSED = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class _Choice:
    """The features of one expression: candidates (marker, axis) with the ramp of each."""

    candidates: tuple[int, ...]
    dead: tuple[float, ...]
    full: tuple[float, ...]
    confused: tuple[str, ...]


def design_system(
    names: Sequence[str],
    neutral: FloatArray,
    basis: FloatArray,
    shape_names: Sequence[str],
    expressions: Sequence[Expression],
    nose_tip: str,
    noise: float,
) -> tuple[FuzzySystem, dict[str, str], list[Finding]]:
    """Design a fuzzy system that tells a rig's expressions apart.

    Parameters
    ----------
    names : sequence of str, length M
        Markers on the character.
    neutral : (M, 3) float64 [m]
        Their places on the neutral mesh.
    basis : (S, M, 3) float64 [m]
        Their displacement by each blend shape at weight 1.
    shape_names : sequence of str, length S
    expressions : sequence of Expression
    nose_tip : str
        Marker that distances are measured to.
    noise : float [m]
        Standard deviation of a marker's position along an axis, e.g. 0.0003.

    Returns
    -------
    system : FuzzySystem
        One output for each expression and one rule for each that the markers show.
    roles : dict of str to str
        Role that the variables name, to marker.
    findings : list of Finding
        EXPRESSION_UNSEEN for each expression that no marker shows, or that the markers cannot
        tell from others.

    Raises
    ------
    InputError
        If there is no such nose tip, or the markers have no extent.
    """
    if nose_tip not in names:
        raise InputError(f"no nose tip: there is no marker {nose_tip!r} among {', '.join(names)}")
    nose = list(names).index(nose_tip)
    # (S, I): features of each blend shape at weight 1, I = 3 M.
    features = (basis - basis[:, nose : nose + 1]).reshape(len(basis), 3 * len(names))
    poses = np.array([e.pose(tuple(shape_names)) for e in expressions])
    poses = poses.reshape(len(expressions), len(basis))
    movements = _movements(shape_names, features)
    choices = {
        expression.name: _choose(i, poses, movements, features, np.sqrt(2) * noise, expressions)
        for i, expression in enumerate(expressions)
    }
    system, roles = _build(names, neutral, nose, choices)
    return system, roles, _findings(choices)


def _movements(shape_names: Sequence[str], features: FloatArray) -> FloatArray:
    """Return what a face may do without meaning an emotion, as weights: (P, S).

    Each blend shape alone; shapes that differ only in their side, together; two of these.
    """
    alone = np.eye(len(shape_names))
    groups: dict[str, list[int]] = defaultdict(list)
    for i, name in enumerate(shape_names):
        groups[_SIDE.sub("*", name)].append(i)
    both = np.array([alone[group].sum(axis=0) for group in groups.values()])
    both = both.reshape(len(groups), len(alone))
    paired = np.argsort(-np.abs(both @ features).sum(axis=1), kind="stable")[:_PAIRED]
    first, second = (paired[i] for i in np.triu_indices(len(paired), k=1))
    return np.concatenate([alone, both, both[first] + both[second]])


def _choose(
    index: int,
    poses: FloatArray,
    movements: FloatArray,
    features: FloatArray,
    noise: float,
    expressions: Sequence[Expression],
) -> _Choice:
    """Choose the features of one expression.

    Parameters
    ----------
    index : int
        Which expression.
    poses : (E, S) float64
    movements : (P, S) float64
        See `_movements`; those that contain the whole expression do not count.
    features : (S, I) float64 [m]
        Of each blend shape at weight 1.
    noise : float [m]
        Of a feature.
    expressions : sequence of Expression, length E
    """
    own = poses[index] @ features
    full = np.abs(own)
    dead = np.maximum(_DEAD_ZONE * noise, _LEAST_DEAD_ZONE * full)
    usable = np.flatnonzero(full > max(_LEAST_SIGNAL * noise, _LEAST_MOTION))
    if not usable.size:
        return _Choice((), (), (), ())
    others = np.delete(np.arange(len(poses)), index)
    partial = movements[(movements < np.sign(poses[index])).any(axis=1)]
    rivals = np.concatenate([poses[others], partial]) @ features[:, usable]
    degrees = np.clip((rivals * np.sign(own[usable]) - dead[usable]) / (full - dead)[usable], 0, 1)
    weights = np.full(len(rivals), _MOVEMENT / max(len(partial), 1))
    weights[: len(others)] = _OTHER_EXPRESSION
    chosen = _cheapest(degrees, weights, _NOISE_COST * (noise / full[usable]) ** 2, usable // 3)
    firing = degrees[: len(others), chosen].min(axis=1)
    confused = tuple(expressions[o].name for o in others[firing > _CONFUSED])
    picked = usable[chosen]
    return _Choice(
        tuple(map(int, picked)),
        tuple(map(float, np.sign(own[picked]) * dead[picked])),
        tuple(map(float, own[picked])),
        confused,
    )


def _cheapest(
    degrees: FloatArray, weights: FloatArray, cost: FloatArray, marker: IntArray
) -> list[int]:
    """Return the features whose conjunction is met least by rival poses, at little noise.

    The best pair, then one by one as long as it pays.

    Parameters
    ----------
    degrees : (P, C) float64
        How far each rival pose meets each candidate's term.
    weights : (P,) float64
    cost : (C,) float64
        Of the noise of each candidate.
    marker : (C,) int64
        A marker is used once.
    """
    single = weights @ degrees**2 + cost
    best = np.argsort(single, kind="stable")[:_SHORTLIST]
    short = degrees[:, best]
    pairs = np.array([weights @ np.minimum(short, one[:, None]) ** 2 for one in short.T])
    pairs += np.maximum(cost[best][:, None], cost[best])
    pairs[marker[best][:, None] == marker[best]] = np.inf
    a, b = np.unravel_index(np.argmin(pairs), pairs.shape)
    if not pairs[a, b] < (1 - _LEAST_GAIN) * single[best[0]]:
        return [int(best[0])]
    chosen, total = [int(best[a]), int(best[b])], pairs[a, b]
    while len(chosen) < _CONDITIONS:
        met = degrees[:, chosen].min(axis=1)
        totals = weights @ np.minimum(degrees, met[:, None]) ** 2
        totals += np.maximum(cost, cost[chosen].max())
        totals[np.isin(marker, marker[chosen])] = np.inf
        following = int(np.argmin(totals))
        if not totals[following] < (1 - _LEAST_GAIN) * total:
            break
        chosen, total = [*chosen, following], totals[following]
    return chosen


def _build(
    names: Sequence[str], neutral: FloatArray, nose: int, choices: dict[str, _Choice]
) -> tuple[FuzzySystem, dict[str, str]]:
    """Write the choices down as variables, terms and rules."""
    unit = marker_spread(neutral)
    roles = _roles(names)
    ramps: dict[int, set[tuple[float, float]]] = defaultdict(set)
    for choice in choices.values():
        for candidate, dead, full in zip(choice.candidates, choice.dead, choice.full, strict=True):
            ramps[candidate].add((dead / unit, full / unit))
    named = {
        candidate: _terms(ramps[candidate], _AXES[candidate % 3], _side(neutral, nose, candidate))
        for candidate in sorted(ramps)
    }
    inputs = {
        candidate: Variable(
            f"{roles[candidate // 3]}_{_AXES[candidate % 3]}",
            "input",
            roles[candidate // 3],
            _AXES[candidate % 3],
            "signed",
            terms,
        )
        for candidate, terms in named.items()
    }
    rules = [
        parse_rule(_text(emotion, choice, inputs, unit))
        for emotion, choice in choices.items()
        if choice.candidates
    ]
    outputs = tuple(Variable(emotion, "output") for emotion in choices)
    used = sorted({candidate // 3 for candidate in inputs})
    return (
        FuzzySystem((*inputs.values(), *outputs), tuple(rules)),
        {roles[m]: names[m] for m in used},
    )


def _text(emotion: str, choice: _Choice, inputs: dict[int, Variable], unit: float) -> str:
    conditions = []
    for candidate, full in zip(choice.candidates, choice.full, strict=True):
        variable = inputs[candidate]
        term = next(t for t in variable.terms if t.parameters[1] == full / unit)
        conditions.append(f"{variable.name} IS {term.name}")
    return f"IF {' AND '.join(conditions)} THEN {emotion} IS 1"


def _roles(names: Sequence[str]) -> list[str]:
    """Return a role for each marker: its label as a lower-case identifier, unique."""
    roles: list[str] = []
    for name in names:
        role = re.sub(r"\W", "_", name).lower()
        role = role if role[:1].isalpha() else f"m_{role}"
        while role in roles:
            role += "_"
        roles.append(role)
    return roles


def _side(neutral: FloatArray, nose: int, candidate: int) -> float:
    """Return 1 on the character's left, -1 on its right, 0 near the midline."""
    offset = float(neutral[candidate // 3, 0] - neutral[nose, 0])
    return float(np.sign(offset)) if abs(offset) > 0.1 * marker_spread(neutral) else 0.0


def _terms(ramps: set[tuple[float, float]], axis: Axis, side: float) -> tuple[Term, ...]:
    """Name the ramps of one variable after the direction and how far they reach."""
    terms = []
    for sign in (1.0, -1.0):
        reaching = sorted((r for r in ramps if r[1] * sign > 0), key=lambda ramp: abs(ramp[1]))
        word = _direction(axis, sign, side)
        degrees = {1: [""], 2: ["slightly_", ""], 3: ["slightly_", "", "far_"]}.get(
            len(reaching), [f"step_{i + 1}_" for i in range(len(reaching))]
        )
        terms += [
            Term(f"{degree}{word}", "ramp", ramp)
            for degree, ramp in zip(degrees, reaching, strict=True)
        ]
    return tuple(terms)


def _direction(axis: Axis, sign: float, side: float) -> str:
    if axis == "y":
        return "raised" if sign > 0 else "lowered"
    if axis == "z":
        return "forward" if sign > 0 else "back"
    if side:
        return "outward" if sign * side > 0 else "inward"
    return "left" if sign > 0 else "right"


def _findings(choices: dict[str, _Choice]) -> list[Finding]:
    findings = []
    for emotion, choice in choices.items():
        if not choice.candidates:
            message = f"no marker shows {emotion} clearly above the noise; it gets no rule"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message))
        elif choice.confused:
            message = f"the markers cannot tell {emotion} from {', '.join(choice.confused)}"
            findings.append(finding("EXPRESSION_UNSEEN", emotion, message))
    return findings
