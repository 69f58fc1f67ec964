"""Opinions of stronger layers, which hide those authored below them.

USD takes the strongest opinion on an attribute whole: a single value hides all samples below it.
"""

from collections.abc import Iterator, Sequence

from pxr import Sdf, Usd

from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.io.usd.held_layers import hold_specs
from usdface.io.usd.overs import prims_of

__all__ = ["check_shown", "check_weights_shown", "hidden_by"]


def check_weights_shown(animation: str, stronger: Sdf.Layer) -> None:
    """Refuse, before any work, to put weights of a SkelAnimation among a layer's sublayers.

    Raises
    ------
    OutputError
        If the layer hides them.
    """
    layer = Sdf.Layer.CreateAnonymous(".usda")
    prim = Sdf.CreatePrimInLayer(layer, animation)
    weights = Sdf.AttributeSpec(prim, "blendShapeWeights", Sdf.ValueTypeNames.FloatArray)
    layer.SetTimeSample(weights.path, 0.0, [0.0])
    try:
        check_shown(layer, stronger)
    finally:
        hold_specs(layer)


def check_shown(overs: Sdf.Layer, stronger: Sdf.Layer) -> None:
    """Refuse to put overs among the sublayers of a layer that hides some of them.

    Raises
    ------
    OutputError
        If it does; the message names the first.
    """
    for made in _properties(overs):
        if _hides(stronger.GetPropertyAtPath(made.path), made):
            raise OutputError(
                f"{stronger.realPath or stronger.identifier} itself has <{made.path}>, which would "
                "hide the result in the layers below it; remove it there, or leave out --in-place"
            )


def hidden_by(overs: Sdf.Layer, stage: Usd.Stage) -> list[Finding]:
    """Return RESULT_HIDDEN for each layer of a stage that hides overs on its edit target.

    The paths of `overs` are the stage's.
    """
    target, hidden = stage.GetEditTarget(), dict[Sdf.Layer, list[str]]()
    for made in _properties(overs):
        for layer in _stronger(stage.GetLayerStack(), target, made.path):
            if _hides(layer.GetPropertyAtPath(made.path), made):
                hidden.setdefault(layer, []).append(str(made.path))
                break
    message = "it has {names} itself, stronger than the result on {layer}, which it hides"
    where = target.GetLayer().GetDisplayName()
    return [
        finding("RESULT_HIDDEN", layer.GetDisplayName(), message, paths, where)
        for layer, paths in hidden.items()
    ]


def _stronger(
    stack: Sequence[Sdf.Layer], target: Usd.EditTarget, path: Sdf.Path
) -> Sequence[Sdf.Layer]:
    """Return the layers whose opinions at a path of the stage are stronger than the target's."""
    if target.MapToSpecPath(path) != path:  # in a variant: weaker than all that is outside of it
        return stack
    return stack[: stack.index(target.GetLayer())]


def _properties(layer: Sdf.Layer) -> Iterator[Sdf.PropertySpec]:
    return (made for prim in prims_of(layer) for made in prim.properties)


def _hides(other: Sdf.PropertySpec | None, made: Sdf.PropertySpec) -> bool:
    """Whether a stronger spec has another value than one that was made, or samples."""
    if not other:
        return False
    if isinstance(other, Sdf.RelationshipSpec):
        return bool(other.HasInfo("targetPaths")) and not _equal(other, made, "targetPaths")
    sampled = any(spec.HasInfo("timeSamples") for spec in (other, made))
    if sampled:
        return bool(other.HasInfo("timeSamples") or other.HasInfo("default"))
    return bool(other.HasInfo("default")) and not _equal(other, made, "default")


def _equal(first: Sdf.Spec, second: Sdf.Spec, name: str) -> bool:
    return bool(second.HasInfo(name) and first.GetInfo(name) == second.GetInfo(name))
