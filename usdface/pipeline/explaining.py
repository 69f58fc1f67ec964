"""Inspection of a shot's fuzzy system: `usdface fuzzy explain` and `usdface fuzzy neutral`."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from usdface.arguments import checked
from usdface.arrays import FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.correction.neutral_check import NeutralResponse, neutral_responses
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.figures.picture import check_picture
from usdface.findings import Finding
from usdface.io.atomic import StrPath
from usdface.io.inputs import check_outputs, files_read
from usdface.io.plugins import hook_report, installed_hooks
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.options import ProcessOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.shot.explanation import Explanation, explain_result
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot
from usdface.takes.frame_index import check_frame, frame_at

__all__ = ["check_neutral", "explain"]


@checked
@one_blas_thread()
def explain(
    shot: StrPath,
    *,
    frame: int | None = None,
    time: float | None = None,
    figure: StrPath | None = None,
    skip_hooks: Sequence[str] = (),
    options: ProcessOptions = ProcessOptions(),
    on_progress: OnProgress | None = None,
) -> Result[Explanation]:
    """Explain why a frame of a shot gets its emotions: features, memberships, rules, weights.

    Parameters
    ----------
    shot : path
        It is processed in memory; nothing is written.
    frame : int, optional
        Frame index of the take; the one in which the strongest emotion is strongest, if left out.
    time : float [s], optional
        The frame nearest to it, in place of a frame index.
    figure : path, optional
        Draw the explanation: .png, .svg or .pdf.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run: distributions, or "distribution:entry point".
    options : ProcessOptions
        Those that the shot is processed with: with others its result is another.
    on_progress : callable, optional

    Returns
    -------
    Result of Explanation
        Keys of the summary: ``frame``, ``time_s``; `details` are those of the frame
        (`Explanation.frame`).

    Raises
    ------
    InputError
        If the shot cannot be processed, has no fuzzy system, or has no such frame.

    Examples
    --------
    >>> result = usdface.explain("examples/shot.usda", frame=72)
    >>> max(result.details["emotions"], key=result.details["emotions"].get)
    'joy'
    """
    if frame is not None and time is not None:
        raise InputError("a frame index and a time are given; expected one of them")
    path, picture = Path(shot), Path(figure) if figure else None
    check_picture(picture)
    progress = Progress.of(on_progress)
    with progress.step("read"):
        check_outputs([picture], files_read(path))
        hooks, skipped = installed_hooks(skip_hooks)
        read, _, findings = _read(path)
        _check_frame(read.take.times, frame, time)
    if not options.express:
        raise InputError("express is False: then there is no correction to explain")
    traced = replace(options, trace=True)
    solved = retarget(read, options=traced, hooks=hooks, on_progress=progress)
    explanation = explain_result(solved)
    index = explanation.peak if frame is None else frame
    if time is not None:
        index = explanation.frame_at(time)
    facts = explanation.frame(index)
    if picture:
        from usdface.figures.explanation import write_explanation_figure

        with progress.step("draw"):
            write_explanation_figure(explanation, index, picture)
    return Result(
        explanation,
        (picture,) if picture else (),
        (*skipped, *findings, *solved.findings),
        {"frame": index, "time_s": facts["time_s"]},
        facts | hook_report(hooks),
        progress.seconds,
    )


@checked
@one_blas_thread()
def check_neutral(
    shot: StrPath, *, on_progress: OnProgress | None = None
) -> Result[tuple[NeutralResponse, ...]]:
    """Evaluate the fuzzy paper's system and that of a shot on a neutral face.

    Parameters
    ----------
    shot : path
    on_progress : callable, optional

    Returns
    -------
    Result of tuple of NeutralResponse
        `details` has ``responses``: the same as plain values.

    Raises
    ------
    InputError
        If the shot cannot be read or has no fuzzy system.

    Examples
    --------
    >>> paper, own = usdface.check_neutral("examples/shot.usda").value
    >>> paper.exact["anger"], own.exact["anger"]
    (1.0, 0.0)
    """
    progress = Progress.of(on_progress)
    with progress.step("read"):
        read, system, findings = _read(Path(shot))
    with progress.step("evaluate"):
        responses = neutral_responses(read.rig, read.setup, system)
    details = {"responses": [response.as_dict() for response in responses]}
    return Result(responses, (), tuple(findings), details=details, seconds=progress.seconds)


def _check_frame(times: FloatArray, frame: int | None, time: float | None) -> None:
    """Refuse a frame that the take does not have before it is solved."""
    if frame is not None:
        check_frame(times, frame)
    if time is not None:
        frame_at(times, time)


def _read(path: Path) -> tuple[Shot, ExpressionSystem, list[Finding]]:
    register_schemas()
    stage = open_shot(path)
    staged, findings = read_shot(stage, str(path))
    system = staged.shot.system
    if system is None:
        raise InputError(
            f"{path} has no fuzzy system; `usdface shot` designs one where markers are bound (for "
            "a take of weights: --bind with the places of `usdface markers`)"
        )
    return staged.shot, system, findings
