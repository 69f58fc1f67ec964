"""The layers that `process` writes: the solve, express and closure layers, and the root over them.

Samples of a stronger layer hide all samples of weaker ones, so each layer holds complete arrays
over all frames. Each has its own timeCodesPerSecond: without it, USD scales the time codes of a
layer by the ratio to its fallback of 24.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pxr import Sdf, Usd

from usdface.io.atomic import all_or_none, remove_when_written
from usdface.io.layer_paths import LayerPaths, layer_paths
from usdface.io.usd.animation import closure_animation, express_animation, solve_animation
from usdface.io.usd.animation_write import author
from usdface.io.usd.fingerprint import is_unedited, sign
from usdface.io.usd.generation import mark_generation
from usdface.io.usd.metrics import Metrics, new_layer
from usdface.io.usd.save_layers import relative_asset, save_layer
from usdface.io.usd.shot import StagedShot
from usdface.io.usd.stage import open_stage
from usdface.io.usd.stronger_opinions import check_shown
from usdface.schemas import write_fallback_types
from usdface.shot.shot import ShotResult
from usdface.verdict.judge import Verdict

__all__ = ["open_shot", "write_layers"]

# Metadata that USD reads from the root layer of a stage alone, so that the shot's are repeated.
_OF_THE_ROOT = (
    *("defaultPrim", "expressionVariables", "fallbackPrimTypes"),
    *("kilogramsPerUnit", "renderSettingsPrimPath"),
)


def open_shot(shot: Path, root: Path | None = None) -> Usd.Stage:
    """Open a shot without the layers that `write_layers` added to it.

    Raises
    ------
    InputError
        If it cannot be opened.
    """
    own_layers = layer_paths(shot, root)
    return open_stage(shot, without=own_layers.layers)


def write_layers(
    shot_path: Path,
    shot: StagedShot,
    result: ShotResult,
    *,
    root: Path | None,
    in_place: bool,
    verdict: Verdict | None,
    deviations: Mapping[str, float],
    generation: str,
) -> list[Path]:
    """Write the solve, express and closure layers and the root over them; all of them or none.

    A layer of an earlier run that has no successor is removed.

    Parameters
    ----------
    shot_path : Path
    shot : StagedShot
    result : ShotResult
    root : Path or None
        The root layer of the result; None = beside the shot.
    in_place : bool
        Add the layers to the shot's own subLayers instead of a new root; that is idempotent.
    verdict : Verdict or None
        Kept in the solve layer, as are `deviations`.
    deviations : mapping of str to float
        Standard deviation of the weight of each solved blend shape.
    generation : str
        Of the result; all layers but the shot itself get it.

    Returns
    -------
    list of Path
        The written files, the one to open first.

    Raises
    ------
    OutputError
        If a file cannot be written, or the shot itself hides the result; then none is replaced.
    """
    paths = layer_paths(shot_path, root)
    span = (float(shot.codes[0]), float(shot.codes[-1]))
    clock = shot.metrics.time_codes_per_second, shot.metrics.frames_per_second
    metrics = Metrics(shot.metrics.meters_per_unit, shot.metrics.up_axis, *clock, *span)
    contents = (
        (paths.solve, solve_animation(result, deviations, verdict)),
        (paths.express, express_animation(result)),
        (paths.closure, closure_animation(result)),
    )
    stronger_first = [path for path, animation in reversed(contents) if animation is not None]
    with all_or_none():
        for path, animation in contents:
            if animation is not None:  # one after the other: each takes kilobytes a frame
                overs = new_layer(metrics)
                author(overs, shot, animation)
                if in_place:
                    check_shown(overs, shot.stage.GetRootLayer())
                mark_generation(overs, generation)
                sign(overs, take=True)
                save_layer(overs, path, names_files=False)
                del overs
        if in_place:
            top = _top_layer(shot.stage, paths, shot_path, stronger_first)
            save_layer(top, shot_path)
        else:
            root_layer = _root_layer(shot.stage, metrics, paths, shot_path, stronger_first)
            mark_generation(root_layer, generation)
            sign(root_layer)  # last: of all that is in it
            save_layer(root_layer, paths.root)
        for path in paths.layers:  # of an earlier run that had one more
            if path not in stronger_first:
                remove_when_written(path)
    return [shot_path if in_place else paths.root, *stronger_first]


def _top_layer(
    stage: Usd.Stage, paths: LayerPaths, shot: Path, stronger_first: list[Path]
) -> Sdf.Layer:
    """Return the shot's own layer with these as its strongest sublayers."""
    top = Sdf.Layer.CreateAnonymous(".usda")
    top.TransferContent(stage.GetRootLayer())
    added = [relative_asset(path, shot) for path in stronger_first]
    previous = {relative_asset(path, shot) for path in paths.layers}
    top.subLayerPaths = added + [p for p in top.subLayerPaths if p not in previous]
    if is_unedited(stage.GetRootLayer()):
        sign(top)
    return top


def _root_layer(
    stage: Usd.Stage, metrics: Metrics, paths: LayerPaths, shot: Path, stronger_first: list[Path]
) -> Sdf.Layer:
    top = stage.GetRootLayer()
    layer = new_layer(_played(stage, metrics))
    for name in filter(top.pseudoRoot.HasInfo, _OF_THE_ROOT):
        layer.pseudoRoot.SetInfo(name, top.pseudoRoot.GetInfo(name))
    layer.subLayerPaths = [relative_asset(path, paths.root) for path in [*stronger_first, shot]]
    write_fallback_types(layer)
    return layer


def _played(stage: Usd.Stage, metrics: Metrics) -> Metrics:
    """Return the metrics of a take with a range that holds that of the shot, too.

    Unless the two lie apart, as where a take was moved on the timeline: the take's alone.
    """
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    apart = start > metrics.end or end < metrics.start
    if apart or not stage.HasAuthoredTimeCodeRange():
        return metrics
    return replace(metrics, start=min(start, metrics.start), end=max(end, metrics.end))
