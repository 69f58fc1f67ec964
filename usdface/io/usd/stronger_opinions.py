"""Opinions of stronger layers, which hide those authored below them.

USD takes the strongest opinion on an attribute whole: a single value hides all samples below it.
"""

from collections.abc import Iterator, Sequence

from pxr import Sdf, Usd, Vt

from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.io.usd.generation import layer_generation
from usdface.io.usd.held_layers import hold_specs
from usdface.io.usd.overs import prims_of

__all__ = ["check_shown", "check_weights_shown", "edits_hidden", "hidden_by"]

_VALUES = ("default", "timeSamples", "spline")  # fields of a spec that has any


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
    layer.SetTimeSample(weights.path, 0.0, Vt.FloatArray(1))
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


def edits_hidden(stage: Usd.Stage, animation: str, moves_joints: bool) -> list[Finding]:
    """Return EDIT_HIDDEN for each layer of a shot that edits an earlier result below it.

    The new result lies over them all.

    Parameters
    ----------
    stage : Usd.Stage
        The shot, before the new result is among its layers; an earlier one that is may be muted.
    animation : str
        Path of the SkelAnimation that results are authored on.
    moves_joints : bool
        Whether the new result has its joints, too.
    """
    whole = Usd.Stage.Open(stage.GetRootLayer()) if stage.GetMutedLayers() else stage
    prim = whole.GetPrimAtPath(animation)
    edited: dict[Sdf.Layer, list[str]] = {}
    results = []
    for name in ("blendShapeWeights", *(("rotations", "translations") if moves_joints else ())):
        attribute = prim.GetAttribute(name) if prim else None
        specs = attribute.GetPropertyStack() if attribute else []
        layers = [spec.layer for spec in specs if any(map(spec.HasInfo, _VALUES))]
        made = [number for number, layer in enumerate(layers) if layer_generation(layer)]
        for layer in layers[: made[0]] if made else ():
            edited.setdefault(layer, []).append(f"{animation}.{name}")
        results += [layers[number].GetDisplayName() for number in made]
    message = (
        "it edits {names} of an earlier result ({layer}), and the new one hides that: process the "
        "shot itself, and lay the edits over its result"
    )
    return [
        finding("EDIT_HIDDEN", layer.GetDisplayName(), message, names, results[0])
        for layer, names in edited.items()
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
