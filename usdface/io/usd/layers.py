"""The layers that `process` writes: the solve, express and closure layers, and the root over them.

Samples of a stronger layer hide all samples of weaker ones, so each layer holds complete arrays
over all frames. Each has its own timeCodesPerSecond: without it, USD scales the time codes of a
layer by the ratio to its fallback of 24.
"""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Usd

from usdface.io.atomic import all_or_none, remove_when_written
from usdface.io.layer_paths import LayerPaths, layer_paths
from usdface.io.usd.animation import (
    author,
    closure_animation,
    express_animation,
    solve_animation,
)
from usdface.io.usd.fingerprint import is_unedited, sign
from usdface.io.usd.generation import mark_generation
from usdface.io.usd.shot import StagedShot
from usdface.io.usd.stage import (
    Metrics,
    new_layer,
    open_stage,
    relative_asset,
    save_layers,
)
from usdface.schemas import write_fallback_types
from usdface.shot import ShotResult
from usdface.verdict.judge import Verdict

__all__ = ["open_shot", "write_layers"]


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
    stage: Usd.Stage,
    shot: StagedShot,
    result: ShotResult,
    root: Path | None,
    in_place: bool,
    verdict: Verdict | None,
    deviations: Mapping[str, float],
    generation: str,
) -> list[Path]:
    """Write the solve, express and closure layers and the root over them; all of them or none.

    A layer of an earlier run that has no successor is removed.

    `deviations` are the standard deviations of the weights of the solved blend shapes, by name;
    they and the verdict are kept in the solve layer.
    All but the shot itself get the `generation` of the result.
    With `in_place` the layers are added to the shot's own subLayers instead of a new root;
    that is idempotent.

    Returns
    -------
    list of Path
        The written files, the one to open first.

    Raises
    ------
    OutputError
        If a file cannot be written; then none is replaced.
    """
    paths = layer_paths(shot_path, root)
    span = (float(shot.codes[0]), float(shot.codes[-1]))
    clock = shot.metrics.time_codes_per_second, shot.metrics.frames_per_second
    metrics = Metrics(shot.metrics.meters_per_unit, shot.metrics.up_axis, *clock, *span)
    layers: list[tuple[Path, Sdf.Layer]] = []
    contents = (
        (paths.solve, solve_animation(result, deviations, verdict)),
        (paths.express, express_animation(result)),
        (paths.closure, closure_animation(result)),
    )
    for path, animation in contents:
        if animation is not None:
            overs = new_layer(metrics)
            author(overs, stage, shot, animation)
            layers.append((path, overs))
    stronger_first = [path for path, _ in reversed(layers)]
    if not in_place:
        layers.append((paths.root, _root_layer(stage, metrics, paths, shot_path, stronger_first)))
    for _, layer in layers:
        mark_generation(layer, generation)
    if in_place:
        top = Sdf.Layer.CreateAnonymous(".usda")
        top.TransferContent(stage.GetRootLayer())
        added = [relative_asset(path, shot_path) for path in stronger_first]
        previous = {relative_asset(path, shot_path) for path in paths.layers}
        top.subLayerPaths = added + [p for p in top.subLayerPaths if p not in previous]
        if is_unedited(stage.GetRootLayer()):
            sign(top)
        layers.append((shot_path, top))
    with all_or_none():
        save_layers(layers)
        for path in paths.layers:  # of an earlier run that had one more
            if path not in stronger_first:
                remove_when_written(path)
    return [layers[-1][0], *stronger_first]


def _root_layer(
    stage: Usd.Stage, metrics: Metrics, paths: LayerPaths, shot: Path, stronger_first: list[Path]
) -> Sdf.Layer:
    layer = new_layer(metrics)
    if stage.GetRootLayer().HasDefaultPrim():
        layer.defaultPrim = stage.GetRootLayer().defaultPrim
    layer.subLayerPaths = [relative_asset(path, paths.root) for path in [*stronger_first, shot]]
    write_fallback_types(layer)
    return layer
