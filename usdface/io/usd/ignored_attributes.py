"""Authored attributes and children of usdface prims that have no effect."""

from collections.abc import Iterable, Sequence
from functools import cache

from pxr import Sdf, Usd

from usdface.errors import did_you_mean
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.schemas import plugin_dir, tokens

__all__ = ["ignored_attributes"]

_OURS = "usdface:"
# Attributes that carry the name of a shape, an emotion or a region.
_NAMED = (tokens.PIN_PREFIX, tokens.EMOTION_PREFIX, tokens.RESIDUAL_PREFIX)
# Relationships that may have several targets.
_MANY = (tokens.EXPRESSIONS,)
# May vary by the schema, but the rule base is that of the whole take.
_OF_RULES = (tokens.RULE_WEIGHT, tokens.ENABLED)
_IN_SYSTEM = (tokens.FUZZY_RULE, tokens.FUZZY_VARIABLE)  # prims that a fuzzy system consists of


def ignored_attributes(prims: Sequence[Usd.Prim]) -> list[Finding]:
    """Return SETTING_UNREAD for each attribute or child of usdface prims without effect.

    Parameters
    ----------
    prims : sequence of Usd.Prim
        Their children are examined, too; those that are not active are so on purpose.
    """
    examined = [
        each
        for prim in prims
        for each in (prim, *(child for child in prim.GetAllChildren() if child.IsActive()))
    ]
    findings: dict[str, Finding] = {}
    for prim in examined:
        unlisted = prim.GetTypeName() == tokens.EXPRESSION and prim not in prims
        found = (
            *_attributes(prim),
            *_undefined_child(prim),
            *(_unlisted(prim) if unlisted else ()),
        )
        for path, *message in found:
            findings[path] = finding("SETTING_UNREAD", path, *message)
    return list(findings.values())


@cache
def _schema() -> Sdf.Layer:
    """Return the usdface schemas, from their file: a host may not have registered them."""
    return Sdf.Layer.FindOrOpen(str(plugin_dir() / "generatedSchema.usda"))


def _attributes(prim: Usd.Prim) -> Iterable[tuple[str, ...]]:
    kind = _schema().GetPrimAtPath(f"/{prim.GetTypeName()}") if prim.GetTypeName() else None
    if not kind:
        return
    known = {str(each.name): each for each in kind.properties}
    for written in map(str, prim.GetAuthoredPropertyNames()):
        if not written.startswith(_OURS) or written.startswith(_NAMED):
            continue
        where = f"<{prim.GetPath()}>.{written}"
        if written not in known:
            hint = Prose(did_you_mean(written, known))
            yield where, "unknown attribute {attribute}{hint}", written, hint
        elif written not in _MANY and len(_targets(prim, written)) > 1:
            yield where, "{attribute} has several targets; the first counts", written
        elif known[written].variability == Sdf.VariabilityUniform and _has_samples(prim, written):
            yield (
                where,
                "{attribute} is uniform: one value for the take; its time samples are ignored",
                written,
            )
        elif written in _OF_RULES and _has_samples(prim, written):
            message = (
                "{attribute} of a rule has one value for the take; its time samples are ignored"
            )
            yield where, message, written


def _targets(prim: Usd.Prim, name: str) -> list[Sdf.Path]:
    relation = prim.GetRelationship(name)
    return list(relation.GetTargets()) if relation else []


def _has_samples(prim: Usd.Prim, name: str) -> bool:
    attribute = prim.GetAttribute(name)
    return bool(attribute) and bool(attribute.GetNumTimeSamples() or attribute.HasSpline())


def _unlisted(prim: Usd.Prim) -> Iterable[tuple[str, ...]]:
    """Report an expression beside those of a shot that the shot does not name."""
    message = f"{prim.GetName()} is no target of {tokens.EXPRESSIONS}, and is ignored; add it there"
    yield f"<{prim.GetPath()}>", message


def _undefined_child(prim: Usd.Prim) -> Iterable[tuple[str, ...]]:
    """Report a child without effect: an override of an undefined prim, no type, or another one."""
    parent, kind = prim.GetParent(), prim.GetTypeName()
    name, where = prim.GetName(), f"<{prim.GetPath()}>"
    if kind:
        if parent.GetTypeName() == tokens.FUZZY_SYSTEM and kind not in _IN_SYSTEM:
            expected = did_you_mean(kind, _IN_SYSTEM) or f"; expected {' or '.join(_IN_SYSTEM)}"
            yield where, f"{name} is a {kind}, and is ignored with all in it{expected}"
    elif not parent.IsDefined():
        return
    elif not prim.IsDefined():
        siblings = [child.GetName() for child in parent.GetChildren()]
        message = f"the override of {name} changes nothing: no layer defines it"
        yield where, message + did_you_mean(name, siblings)
    elif parent.GetTypeName() == tokens.FUZZY_SYSTEM:
        yield where, f"{name} has no type and is ignored; write def {tokens.FUZZY_RULE}"
