"""JSON values as customData of USD prims, and back; metadata of conversions stays apart."""

from collections.abc import Callable, Collection, Mapping, Sequence
from math import isfinite
from typing import Any

from pxr import Sdf, Usd, Vt

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.conversion_metadata import KEY
from usdface.io.usd.held_layers import hold
from usdface.io.usd.prim_walks import lineage
from usdface.scene import Extras

__all__ = [
    "USER_PROPERTIES",
    "json_values",
    "prim_of_asset",
    "read_asset",
    "read_extras",
    "usd_values",
    "write_asset",
    "write_extras",
]

USER_PROPERTIES = "userProperties:"  # custom attributes of Blender, Maya and Houdini
_DEEPEST = 16  # levels of nesting, for a stack that stays shallow
_INTS = range(-(2**63), 2**63)  # int64, the widest integer of a USD dictionary


def write_extras(prim: Usd.Prim, extras: Extras) -> list[Finding]:
    """Author extras as customData; null and mixed lists, which it cannot hold, are left out."""
    return _author(prim, extras, prim.SetCustomDataByKey)


def write_asset(prim: Usd.Prim, asset: Extras) -> list[Finding]:
    """Author the extras of a file as assetInfo, as `write_extras` does."""
    return _author(prim, asset, prim.SetAssetInfoByKey)


def _author(prim: Usd.Prim, extras: Extras, put: Callable[[str, object], object]) -> list[Finding]:
    lost: list[str] = []
    for key, value in _usd_dict(extras, "", lost, 0).items():
        if key and ":" not in key and key != KEY:  # else a path of keys, or ours
            put(key, value)
        else:
            lost.append(key)
    return _report_lost(prim, lost)


def usd_values(prim: Usd.Prim, values: Mapping[str, Any]) -> tuple[dict[str, Any], list[Finding]]:
    """Return JSON values as USD holds them in a dictionary of a prim, without those it cannot."""
    lost: list[str] = []
    return _usd_dict(values, "", lost, 0), _report_lost(prim, lost)


def _report_lost(prim: Usd.Prim, lost: list[str]) -> list[Finding]:
    if not lost:
        return []
    message = "extras that USD does not hold: {names}"
    return [
        finding("FEATURE_DROPPED", str(prim.GetPath()), message, sorted(lost), feature="extras")
    ]


def _usd_dict(values: Mapping[str, Any], path: str, lost: list[str], depth: int) -> dict[str, Any]:
    made = {}
    for key, value in values.items():
        held = _usd_value(value, f"{path}{key}", lost, depth)
        if held is not None:
            made[key] = held
    return made


def _usd_value(value: Any, path: str, lost: list[str], depth: int) -> Any:
    if isinstance(value, Mapping) and depth < _DEEPEST:
        return _usd_dict(value, f"{path}.", lost, depth + 1)
    if isinstance(value, bool | str | float) or (isinstance(value, int) and value in _INTS):
        return value
    if isinstance(value, list):
        kinds = {type(v) for v in value}
        held = all(v in _INTS for v in value if type(v) is int)
        if kinds <= {int, float} and float in kinds and held:
            return Vt.DoubleArray([float(v) for v in value])
        for kind, array in ((bool, Vt.BoolArray), (int, Vt.Int64Array), (str, Vt.StringArray)):
            if kinds <= {kind} and held:
                return array(value)
    lost.append(path)
    return None


def read_extras(prim: Usd.Prim, properties: bool = True) -> tuple[dict[str, Any], list[Finding]]:
    """Return a prim's customData as JSON values, without metadata of conversions and of schemas.

    With its `properties`: the custom attributes of users (``userProperties:``) that do not change
    over time, under their names; parts of names with a colon are nested.
    """
    authored: dict[str, Any] = _user_properties(prim) if properties else {}
    specs = prim.GetPrimStack()
    hold(specs)
    for spec in reversed(specs):  # the composed value has the schema's own in it
        authored |= dict(spec.customData)
    return _read(prim, authored, (KEY,))


def _user_properties(prim: Usd.Prim) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for attribute in prim.GetAuthoredPropertiesInNamespace(USER_PROPERTIES):
        if not isinstance(attribute, Usd.Attribute) or changes(attribute):
            continue
        value = attribute.Get(Usd.TimeCode.EarliestTime())
        if value is None:
            continue
        *above, name = attribute.GetName().removeprefix(USER_PROPERTIES).split(":")
        holder = found
        for depth, part in enumerate(above):
            inner = holder.setdefault(part, {})
            if not isinstance(inner, dict):  # `a` is a value beside `a:b`, which becomes `a_b`
                name = "_".join((*above[depth:], name))
                break
            holder = inner
        holder[name] = value
    return found


def prim_of_asset(top: Usd.Prim, roots: Sequence[Usd.Prim]) -> Usd.Prim:
    """Return the prim that has the assetInfo of a scene: its top, else that of a single character.

    A shot references its character, whose copyright and avatar are noted there.
    """
    above = reversed([*lineage(roots[0])]) if len(roots) == 1 else ()
    return next((prim for prim in (top, *above) if prim.HasAuthoredAssetInfo()), top)


def read_asset(prim: Usd.Prim) -> tuple[dict[str, Any], list[Finding]]:
    """Return a prim's assetInfo as JSON values."""
    return _read(prim, prim.GetAssetInfo(), ())


def _read(
    prim: Usd.Prim, given: Mapping[str, Any] | None, ours: Collection[str]
) -> tuple[dict[str, Any], list[Finding]]:
    return json_values(prim, {k: v for k, v in (given or {}).items() if k not in ours})


def json_values(prim: Usd.Prim, given: Mapping[str, Any]) -> tuple[dict[str, Any], list[Finding]]:
    """Return a dictionary of a prim as JSON values."""
    lost: list[str] = []
    made = _json_dict(given, "", lost)
    if not lost:
        return made, []
    message = "metadata that JSON does not hold: {names}"
    return made, [
        finding("FEATURE_DROPPED", str(prim.GetPath()), message, sorted(lost), feature="metadata")
    ]


def _json_dict(values: Mapping[str, Any], path: str, lost: list[str]) -> dict[str, Any]:
    made = {}
    for key, value in values.items():
        held = _json_value(value, f"{path}{key}", lost)
        if held is not None:
            made[key] = held
    return made


def _json_value(value: Any, path: str, lost: list[str]) -> Any:
    if isinstance(value, Mapping):
        return _json_dict(value, f"{path}.", lost)
    if _is_plain(value):
        return value
    if isinstance(value, Sdf.AssetPath):
        return value.path
    try:
        listed = [v.path if isinstance(v, Sdf.AssetPath) else v for v in value]
        if all(map(_is_plain, listed)):
            return listed
        rows = [list(v) for v in listed]  # vectors
        if all(_is_plain(v) and not isinstance(v, str) for row in rows for v in row):
            return rows
    except TypeError:
        pass
    lost.append(path)
    return None


def _is_plain(value: Any) -> bool:
    """Return whether JSON has such a value: it knows no infinity and no NaN."""
    if isinstance(value, float):
        return isfinite(value)
    return isinstance(value, bool | int | str)
