"""Names of marker roles, features and their terms."""

import re
from collections.abc import Iterable, Mapping, Sequence

from usdface.arrays import FloatArray
from usdface.expression_system import Axis, MarkerFeature, Measure
from usdface.face.mirror import sides_of
from usdface.geometry.marker_spread import marker_spread

__all__ = [
    "AXES",
    "degree_prefixes",
    "direction_name",
    "direction_names",
    "known_roles",
    "marker_features",
    "marker_sides",
    "role_names",
]

AXES: tuple[Axis, ...] = ("x", "y", "z")
# A marker this close to the midline, in face units, has no inward and outward: about 6 mm. Chosen
# by hand, no experiment; which terms share a name depends on it.
_MIDLINE = 0.1
_DEGREES = {1: ("",), 2: ("slightly_", ""), 3: ("slightly_", "", "far_")}


def role_names(names: Sequence[str]) -> list[str]:
    """Return a role for each marker: its label as a lower-case identifier, unique."""
    roles: list[str] = []
    for name in names:
        role = re.sub(r"\W", "_", name).lower()
        role = role if role[:1].isalpha() else f"m_{role}"
        while role in roles:
            role += "_"
        roles.append(role)
    return roles


def marker_sides(neutral: FloatArray, nose: int) -> list[int]:
    """Return 1 for a marker on the character's left, -1 on its right, 0 near the midline.

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
    nose : int
        Index of the nose tip.
    """
    reach = _MIDLINE * marker_spread(neutral)
    return [int(side) for side in sides_of(neutral, float(neutral[nose, 0]), reach)]


def known_roles(names: Sequence[str], roles: Mapping[str, str]) -> dict[str, str]:
    """Return role to marker for all markers: the given `roles`, else their labels.

    Parameters
    ----------
    names : sequence of str
        Markers.
    roles : mapping of str to str
        Role to marker, as in `RetargetSetup.roles`; other markers' roles are left out.
    """
    given = {role: name for role, name in roles.items() if name in names and role.isidentifier()}
    named = set(given.values())
    found = {marker: role for role, marker in reversed(given.items())}
    for name, role in zip(names, role_names(names), strict=True):
        if name not in named:
            while role in given:
                role += "_"
            found[name] = role
    return {found[name]: name for name in names}


def marker_features(roles: Iterable[str], measure: Measure = "signed") -> tuple[MarkerFeature, ...]:
    """Return the feature of each marker along each axis: (3 M,), x, y, z in turn."""
    return tuple(MarkerFeature(role, axis, measure) for role in roles for axis in AXES)


def direction_names(neutral: FloatArray, nose: int) -> tuple[tuple[str, str], ...]:
    """Return the names of a negative and a positive value of each feature: (3 M,).

    Parameters
    ----------
    neutral : (M, 3) float64 [m]
    nose : int
        Index of the nose tip.
    """
    sides = marker_sides(neutral, nose)
    return tuple(
        (direction_name(axis, -1, side), direction_name(axis, 1, side))
        for side in sides
        for axis in AXES
    )


def direction_name(axis: Axis, sign: int, side: int) -> str:
    """Return the word for a motion along an axis, of a marker on that `side` (0 = midline)."""
    if axis == "y":
        return "raised" if sign > 0 else "lowered"
    if axis == "z":
        return "forward" if sign > 0 else "back"
    if side:
        return "outward" if sign == side else "inward"
    return "left" if sign > 0 else "right"


def degree_prefixes(count: int) -> tuple[str, ...]:
    """Return prefixes to the name of a direction, for terms at increasing distance."""
    return _DEGREES.get(count, tuple(f"step_{i + 1}_" for i in range(count)))
