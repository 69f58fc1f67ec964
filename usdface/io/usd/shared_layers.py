"""Layers that shots share: a performer's and a character's, taken out of a shot that is written.

A shot sublayers them, so a change in one is a change in every shot. An existing one is kept as it
is: the shot then has no opinions on its contents.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, UsdGeom

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.save_layers import relative_asset
from usdface.io.usd.stage import open_layer
from usdface.schemas import tokens

__all__ = ["SharedLayers", "share"]

_RETARGET = Sdf.Path("/Shot/Retarget")
_CHARACTER = Sdf.Path("/Shot/Character")
_OF_PERFORMER = ("usdface:calibration:",)
_OF_CHARACTER = (
    *("usdface:bind:", "usdface:contact:", "usdface:roles:", tokens.NOSE_TIP, tokens.HEAD_JOINT),
    *(tokens.EYE_JOINTS, tokens.EYE_TURN),
    *(tokens.LEFT_SHAPES, tokens.RIGHT_SHAPES, tokens.BROWS_SHAPES, tokens.EYES_SHAPES),
    *(tokens.MOUTH_SHAPES, tokens.ANTAGONISTS, tokens.RIG, tokens.SYSTEM, tokens.EXPRESSIONS),
)
_FUZZY = Sdf.Path("/Shot/Fuzzy")
_PRIMS_OF_CHARACTER = (_CHARACTER, _FUZZY, Sdf.Path("/Shot/Expressions"))


@dataclass(frozen=True, slots=True)
class SharedLayers:
    """Paths of a shot's shared layers; None: their contents stay in the shot."""

    performer: Path | None = None
    character: Path | None = None


def share(
    shot: Sdf.Layer, place: Path, layers: SharedLayers, rules: str = ""
) -> tuple[list[tuple[Path, Sdf.Layer]], list[Finding]]:
    """Move the contents of shared layers out of a shot's layer, and sublayer these.

    Parameters
    ----------
    shot : Sdf.Layer
        As `write_shot` makes it; it is changed.
    place : Path
        Where it will be written: its asset paths are relative to that.
    layers : SharedLayers
    rules : str
        Name of the file that the shot's own rule base is from; "" = designed for the rig.

    Returns
    -------
    list of (Path, Sdf.Layer)
        Shared layers that are not there yet, to be written.
    list of Finding
        LAYER_KEPT for an existing one that differs from this shot's contents for it;
        LAYER_RULES_DIFFER where its rule base does.

    Raises
    ------
    InputError
        If a shared layer that is there cannot be read, or is that of another character.
    """
    new, findings = [], []
    for path, prefixes, prims in (
        (layers.character, _OF_CHARACTER, _PRIMS_OF_CHARACTER),
        (layers.performer, _OF_PERFORMER, ()),
    ):
        if path is None:
            continue
        mine = _taken_out(shot, place, path, prefixes, prims)
        shot.subLayerPaths.append(relative_asset(path, place))
        if not path.is_file():
            new.append((path, mine))
            continue
        there = open_layer(path)
        _check_character(there, mine, path)
        if differing := _differing(there, mine):
            message = "{file} is there and kept; it differs from this shot's own in {attributes}"
            findings.append(finding("LAYER_KEPT", str(path), message, str(path), differing))
        if path == layers.character:
            findings += _report_rules(there, mine, path, str(place), rules)
    return new, findings


def _taken_out(
    shot: Sdf.Layer,
    place: Path,
    path: Path,
    prefixes: tuple[str, ...],
    prims: tuple[Sdf.Path, ...],
) -> Sdf.Layer:
    """Move properties of the setup, and whole prims, from a shot to a new layer at `path`."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    for key in (UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis):
        layer.pseudoRoot.SetInfo(key, shot.pseudoRoot.GetInfo(key))
    setup = shot.GetPrimAtPath(_RETARGET)
    for name in [p.name for p in setup.properties if p.name.startswith(prefixes)]:
        Sdf.CreatePrimInLayer(layer, _RETARGET)
        source = _RETARGET.AppendProperty(name)
        Sdf.CopySpec(shot, source, layer, source)
        setup.RemoveProperty(setup.properties[name])
    for prim in (p for p in prims if shot.GetPrimAtPath(p)):
        Sdf.CreatePrimInLayer(layer, prim)
        Sdf.CopySpec(shot, prim, layer, prim)
        spec = shot.GetPrimAtPath(prim)
        del spec.nameParent.nameChildren[spec.name]
    character = layer.GetPrimAtPath(_CHARACTER)
    if character:
        character.referenceList.prependedItems = [
            Sdf.Reference(
                relative_asset(place.parent / reference.assetPath, path), reference.primPath
            )
            for reference in character.referenceList.prependedItems
        ]
    return layer


def _check_character(there: Sdf.Layer, mine: Sdf.Layer, path: Path) -> None:
    """Refuse a layer of another rig: vertices of one are no places on the other."""
    rigs = [
        [(path.parent / r.assetPath).resolve() for r in prim.referenceList.prependedItems]
        for layer in (there, mine)
        if (prim := layer.GetPrimAtPath(_CHARACTER))
    ]
    if len(rigs) == 2 and rigs[0] != rigs[1]:
        names = ", ".join(str(rig) for rig in rigs[0])
        raise InputError(
            f"{path} is the layer of another character, {names}; name another layer, or that rig",
            "SETTING_WRONG",
        )


def _differing(there: Sdf.Layer, mine: Sdf.Layer) -> list[str]:
    """Return paths of properties whose values differ, or that only `mine` has."""
    return [
        str(path)
        for path in _properties(mine)
        if not (other := there.GetPropertyAtPath(path))
        or _value(other) != _value(mine.GetPropertyAtPath(path))
    ]


def _report_rules(
    there: Sdf.Layer, mine: Sdf.Layer, path: Path, shot: str, rules: str
) -> list[Finding]:
    """Report the rule base of a shared layer that a shot gets in place of its own.

    Also where the layer has rules that the shot has not: those act on the shot, too. Settings of
    the correction, on the prim of the system itself, are no part of a rule base.
    """
    kept, own = (
        {
            place: _value(layer.GetPropertyAtPath(place))
            for place in _properties(layer)
            if place.GetPrimPath().HasPrefix(_FUZZY) and place.GetPrimPath() != _FUZZY
        }
        for layer in (there, mine)
    )
    if kept == own:
        return []
    kept_rules, own_rules = (
        {str(value) for place, value in held.items() if place.name == tokens.RULE_TEXT}
        for held in (kept, own)
    )
    if not own_rules:  # as of a take of weights, which binds no marker
        message = "gets the rule base of {file}, of {kept_count} rules; it has none of its own"
        return [finding("LAYER_RULES_DIFFER", shot, message, str(path), len(kept_rules))]
    message = (
        "gets the rule base of {file}, of {kept_count} rules, in place of its own {rule_count} "
        "({name}), of which {shared_count} read the same"
    )
    own_name = rules or "designed for the rig"
    counts = len(kept_rules), len(own_rules), own_name, len(kept_rules & own_rules)
    return [finding("LAYER_RULES_DIFFER", shot, message, str(path), *counts)]


def _properties(layer: Sdf.Layer) -> Iterator[Sdf.Path]:
    found: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, found.append)
    return (path for path in found if path.IsPrimPropertyPath())


def _value(spec: Sdf.PropertySpec) -> object:
    if isinstance(spec, Sdf.RelationshipSpec):
        return str(spec.targetPathList)
    return spec.default
