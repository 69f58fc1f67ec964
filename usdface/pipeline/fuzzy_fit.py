"""A fuzzy system learned from poses or labelled takes: `usdface fuzzy fit`."""

from pathlib import Path

from usdface.face.expression_poses import expressions_for
from usdface.findings import Finding
from usdface.io.atomic import all_or_none, check_place, write_text
from usdface.io.bind_file import read_bind
from usdface.io.expressions_file import expressions_json
from usdface.io.fuzzy_formats.files import write_fuzzy_file
from usdface.io.labels_file import read_labels
from usdface.io.takes.any_take import read_any_take
from usdface.io.usd.layers import open_shot
from usdface.io.usd.rig import read_rig
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import files_of, open_stage
from usdface.options import FitOptions
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.retarget_setup import Expression, fit_setup
from usdface.rule_learning.fitting import Fitted, fit_labelled, fit_rig
from usdface.rule_learning.labelled_takes import Face, examples_of

__all__ = ["fit_fuzzy"]


def fit_fuzzy(
    source: Path,
    output: Path,
    options: FitOptions = FitOptions(),
    on_step: OnStep | None = None,
    bind: Path | None = None,
    labels: Path | None = None,
    poses: Path | None = None,
) -> tuple[Result, Fitted]:
    """Fit a fuzzy system to the face of a shot, or of a rig with a binding, and write it.

    Parameters
    ----------
    source : Path
        A shot; with `bind` a rig.
    output : Path
        The system: .usda, .usdc, .fis, .fcl or .fll.
    options : FitOptions
    on_step : callable, optional
    bind : Path, optional
        Where markers sit on the rig.
    labels : Path, optional
        Labelled takes to learn from; without them the rig's own expression poses count.
    poses : Path, optional
        Where to write the expression poses, JSON.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.
    """
    register_schemas()
    steps = Steps(on_step)
    given = [source, *(path for path in (bind, labels) if path)]
    places = [output, *([poses] if poses else [])]
    for place in places:
        check_place(place, *given)
    with steps("read"):
        face, expressions, findings, files = _face(source, bind)
        stretches = read_labels(labels) if labels else ()
        for place in places:
            check_place(place, *files, *{label.take for label in stretches})
    if labels:
        labelled, more = examples_of(stretches, face, read_any_take, options, steps)
        findings += more
    with steps("fit"):
        fitted = (
            fit_labelled(labelled, face, options) if labels else fit_rig(face, expressions, options)
        )
    with steps("write"), all_or_none():
        findings += write_fuzzy_file(output, fitted.system)
        if poses:
            write_text(poses, expressions_json(fitted.expressions))
    findings += fitted.findings
    outcome = Result(tuple(places), tuple(findings), fitted.summary, steps.seconds, fitted.details)
    return outcome, fitted


def _face(
    source: Path, bind: Path | None
) -> tuple[Face, tuple[Expression, ...], list[Finding], list[Path]]:
    """Read the face of a shot, or of a rig and a binding, its expression poses, and the files."""
    if bind is None:
        stage = open_shot(source)
        files = files_of(stage)
        shot, findings = read_shot(stage, str(source))
        rig, setup, expressions = shot.rig, shot.setup, shot.expressions
    else:
        files = files_of(open_stage(source))
        rig, findings = read_rig(source)
        setup, more = read_bind(bind)
        expressions, _ = expressions_for(rig.shape_names)
        findings += more
    mesh = rig.mesh(setup.binding.mesh)
    setup, more = fit_setup(setup, mesh)
    return Face(mesh, rig.shape_names, setup), expressions, findings + more, files
