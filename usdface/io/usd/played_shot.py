"""Reading a processed shot from its stage: the shot, and the contents of its result layers."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.findings import Finding
from usdface.io.layer_paths import layer_paths
from usdface.io.usd.animation_write import OCCLUDED_INPUT
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.metrics import Metrics, metrics_of, to_si
from usdface.io.usd.shot import StagedShot, base_weights, read_shot
from usdface.schemas import tokens
from usdface.shot.played_shot import PlayedShot
from usdface.takes import WeightsTake
from usdface.verdict.judge import Verdict, verdict_from

__all__ = ["defines_setup", "has_setup", "read_played_shot"]

_LONGEST_VERDICT = 100_000  # characters
_CLOSURES = {
    "left eye": tokens.CLOSURE_LEFT_EYE,
    "right eye": tokens.CLOSURE_RIGHT_EYE,
    "mouth": tokens.CLOSURE_MOUTH,
}


def has_setup(stage: Usd.Stage) -> bool:
    """Return whether a stage has the setup of a shot."""
    return any(_setups(stage))


def defines_setup(stage: Usd.Stage) -> bool:
    """Return whether the root layer of a stage itself defines the setup of a shot."""
    layer = stage.GetRootLayer()
    specs = (layer.GetPrimAtPath(prim.GetPath()) for prim in _setups(stage))
    return any(spec is not None and spec.specifier == Sdf.SpecifierDef for spec in specs)


def _setups(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    return (prim for prim in stage.Traverse() if prim.GetTypeName() == tokens.RETARGET)


def read_played_shot(
    stage: Usd.Stage, where: str, asset_root: Path | None = None
) -> tuple[PlayedShot, list[Finding]]:
    """Read a processed shot.

    Parameters
    ----------
    stage : Usd.Stage
        With the setup of a shot; that it was processed is not required.
    where : str
        Names the stage in errors.
    asset_root : Path, optional
        A folder that textures may also come from.

    Raises
    ------
    InputError
        If the stage has no shot, or a curve of the result has not as many values as it should.
    """
    staged, findings = read_shot(stage, where, asset_root)
    with usd_errors(where):
        rig, clips, new_findings = animated_rig(stage, asset_root)
        corrected = _weights(staged)
        solved = _solved_weights(staged) or corrected
        retarget = stage.GetPrimAtPath(staged.prims.retarget)
        played = _with_solution(
            PlayedShot(rig, None, staged.shot, solved, corrected), retarget, staged
        )
        if staged.prims.fuzzy:
            played = _with_expressions(played, stage.GetPrimAtPath(staged.prims.fuzzy), staged)
    clip = _on_clock(clips[0], staged) if clips else None
    played = replace(played, clip=clip, start_code=float(staged.codes[0]))
    return played, findings + [f for f in new_findings if f not in findings]


def _on_clock(clip: Clip, staged: StagedShot) -> Clip:
    """Return a clip on the clock of the take, whose first frame is at 0 s."""
    metrics = metrics_of(staged.stage)
    if clip.joints is None:
        return clip
    begin = metrics.start if staged.stage.HasAuthoredTimeCodeRange() else float(staged.codes[0])
    begin = min(begin, float(staged.codes[0]))
    shift = (float(staged.codes[0]) - begin) / metrics.time_codes_per_second
    joints: JointsTake = replace(clip.joints, times=clip.joints.times - shift)
    return replace(clip, joints=joints)


def _solved_weights(staged: StagedShot) -> WeightsTake | None:
    """Return the weights below the express and closure layers; None where there is no such layer.

    The layers are muted while they are read.
    """
    root = Path(staged.stage.GetRootLayer().realPath)
    ours = layer_paths(root, root)
    upper = {path.resolve() for path in (ours.express, ours.closure)}
    in_place = layer_paths(root, None)
    upper |= {path.resolve() for path in (in_place.express, in_place.closure)}
    stack = staged.stage.GetLayerStack()
    over = [layer.identifier for layer in stack if Path(layer.realPath) in upper]
    if not over:
        return None
    staged.stage.MuteAndUnmuteLayers(over, [])
    try:
        return _weights(staged)
    finally:
        staged.stage.MuteAndUnmuteLayers([], over)


def _weights(staged: StagedShot) -> WeightsTake:
    """Return the weights that the stage plays at the frames of the take, 0 where it has none."""
    take = staged.shot.take
    found = base_weights(staged.stage, staged.prims, take, staged.codes)
    if found is not None:
        return found
    names = staged.shot.rig.shape_names
    return WeightsTake(names, take.times, np.zeros((len(take.times), len(names))), take.rate)


def _with_solution(played: PlayedShot, prim: Usd.Prim, staged: StagedShot) -> PlayedShot:
    codes = staged.codes.tolist()
    metre = staged.metrics.meters_per_unit
    markers = tuple(prim.GetAttribute(tokens.SOLVED_MARKERS).Get() or ())
    shapes = prim.GetAttribute(tokens.SOLVED_SHAPES).Get() or ()
    deviations = prim.GetAttribute(tokens.SOLVED_DEVIATIONS).Get() or ()
    distances = _rows(prim, tokens.SOLVED_DISTANCES, codes, (len(markers),))
    distances = np.where(distances < 0, np.nan, distances)
    points = _rows(prim, tokens.FEATURE_POINTS, codes, (len(markers), 3))
    head = _rows(prim, tokens.HEAD_TRANSFORM, codes, (4, 4))
    residual = _rows(prim, tokens.RESIDUAL, codes, ())
    names = [
        attribute.GetName()
        for attribute in prim.GetAuthoredAttributes()
        if attribute.GetName().startswith(tokens.RESIDUAL_PREFIX)
    ]
    regions = {name.rpartition(":")[2]: _rows(prim, name, codes, ()) for name in names}
    closures = {name: _rows(prim, attr, codes, ()) for name, attr in _CLOSURES.items()}
    return replace(
        played,
        markers=markers if len(points) else (),
        feature_points=points @ staged.to_rig[:3, :3],
        distances=distances * metre,
        residual=residual * metre,
        regions={name: curve * metre for name, curve in regions.items() if len(curve)},
        head=_in_metres(head, staged.metrics),
        deviations={str(n): float(d) for n, d in zip(shapes, deviations, strict=False)},
        closures={name: curve for name, curve in closures.items() if curve.any()},
        verdict=_verdict(prim),
    )


def _verdict(prim: Usd.Prim) -> Verdict | None:
    """Return the verdict of the result; None where there is none that can be read."""
    text = prim.GetAttribute(tokens.VERDICT).Get()
    if not text or len(text) > _LONGEST_VERDICT:
        return None
    try:
        return verdict_from(json.loads(text))
    except (ValueError, RecursionError):
        return None


def _with_expressions(played: PlayedShot, prim: Usd.Prim, staged: StagedShot) -> PlayedShot:
    system, codes = staged.shot.system, staged.codes.tolist()
    if system is None:
        return played
    emotions = {e: _rows(prim, tokens.EMOTION_PREFIX + e, codes, ()) for e in system.emotions}
    inputs = _rows(prim, tokens.INPUTS, codes, (len(system.fuzzy.inputs),))
    unit = prim.GetAttribute(tokens.INPUTS_UNIT).Get() or 0.0
    return replace(
        played,
        emotions={name: curve for name, curve in emotions.items() if len(curve)},
        firing=_rows(prim, tokens.FIRING, codes, (len(system.fuzzy.rules),)),
        inputs=np.where(inputs <= OCCLUDED_INPUT, np.nan, inputs),
        unit=float(unit) * staged.metrics.meters_per_unit,
    )


def _in_metres(head: FloatArray, metrics: Metrics) -> FloatArray:
    si = to_si(metrics)
    return np.asarray(np.linalg.inv(si) @ head @ si)


def _rows(prim: Usd.Prim, name: str, codes: Sequence[float], shape: tuple[int, ...]) -> FloatArray:
    """Return the values of a result over the take: (F, *shape); no frames where there are none.

    Values of another shape are those of an older or a foreign result, and left out.
    """
    attribute = prim.GetAttribute(name)
    empty = np.zeros((0, *shape))
    if not attribute or not attribute.GetNumTimeSamples():
        return empty
    rows = [np.asarray(attribute.Get(code), np.float64) for code in codes]
    return np.array(rows) if all(row.shape == shape for row in rows) else empty
