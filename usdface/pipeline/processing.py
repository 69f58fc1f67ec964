"""The main job, retarget and correct: `usdface process`, and on a host's open stage."""

from dataclasses import replace
from pathlib import Path

from usdface.animate import Animated, animate
from usdface.clips import Clip
from usdface.findings import Finding
from usdface.io.atomic import check_place
from usdface.io.usd.animation import apply_animation
from usdface.io.usd.layers import layer_paths, open_shot, write_layers
from usdface.io.usd.shot import Shot, read_shot
from usdface.io.usd.stage import Stage, files_of
from usdface.options import ProcessOptions
from usdface.outcome import OnStep, Outcome, Steps
from usdface.pipeline.schemas import register_schemas

__all__ = ["apply", "process"]


def process(
    path: Path | str,
    options: ProcessOptions = ProcessOptions(),
    on_step: OnStep | None = None,
) -> Outcome:
    """Retarget, correct and write: the main job.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is half-written.
    """
    path = Path(path)
    root = Path(options.output) if options.output else None
    gltf = Path(options.gltf) if options.gltf else None
    figure = Path(options.figure) if options.figure else None
    if figure:
        from usdface.figures.picture import check_picture
        from usdface.figures.take import write_take_figure

        check_picture(figure)
    register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        ours = layer_paths(path, root)
        stage = open_shot(path, root)
        for place in (ours.root, ours.solve, gltf, figure):
            if place:
                check_place(place, *files_of(stage))
        shot, findings = read_shot(stage, str(path))
    solved = animate(stage, shot, options, steps)
    findings += solved.findings
    if gltf:
        with steps("gltf"):
            findings += _write_gltf(shot, solved, gltf)
    with steps("write"):
        written = write_layers(
            path, stage, shot, solved.solve, solved.express, root, options.in_place
        )
    if figure:
        with steps("draw"):
            write_take_figure(solved, figure)
    written += [place for place in (gltf, figure) if place]
    return Outcome(tuple(written), tuple(findings), solved.summary, steps.seconds, solved.details)


def _write_gltf(shot: Shot, solved: Animated, path: Path) -> list[Finding]:
    from usdface.io.gltf.write import write_gltf  # only here: most runs write none
    from usdface.io.head_clip import head_clip

    rig, clip = shot.rig, Clip(Path(solved.weights.source).stem or "take", solved.weights)
    if solved.solve.motion is not None and shot.prims.head is not None:
        rig, joints = head_clip(rig, shot.prims.head.joint, solved.solve.motion, shot.take.times)
        clip = replace(clip, joints=joints)
    return write_gltf(rig, path, (clip,))


def apply(
    stage: Stage, options: ProcessOptions = ProcessOptions(), on_step: OnStep | None = None
) -> Outcome:
    """Do the main job on a stage that a host holds open: author on its edit target.

    The final weights, emotion curves and residual go onto the edit target; nothing is saved.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is authored.
    """
    steps = Steps(on_step)
    with steps("read"):
        shot, findings = read_shot(stage, stage.GetRootLayer().identifier)
    solved = animate(stage, shot, options, steps)
    with steps("write"):
        solve = solved.solve
        final = replace(
            solved.final,
            solution=solve.solution,
            repairs=solve.repairs,
            motion=solve.motion,
            regions=solve.regions,
        )
        apply_animation(stage, shot, final)
    return Outcome(
        (), tuple(findings + solved.findings), solved.summary, steps.seconds, solved.details
    )
