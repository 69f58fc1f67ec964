"""A fuzzy system learned from poses or labelled takes: `usdface fuzzy fit`."""

from pathlib import Path

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.expression_poses import expressions_for
from usdface.face.fitted_setup import fit_setup
from usdface.figures.picture import check_picture
from usdface.findings import Finding
from usdface.io.atomic import StrPath, all_or_none, write_text
from usdface.io.bind_file import read_bind
from usdface.io.expressions_file import expressions_json
from usdface.io.fuzzy_formats.files import write_fuzzy_file
from usdface.io.inputs import check_outputs, files_read
from usdface.io.labels_file import read_labels
from usdface.io.overwrite_protection import check_replaced
from usdface.io.takes.files import read_take
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.options import FitOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rule_learning.fitting import Fitted, fit_labelled, fit_rig
from usdface.rule_learning.labelled_takes import examples_of
from usdface.setup.assumed_mesh import assumed_mesh_findings
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["fit_fuzzy"]


@checked
@one_blas_thread()
def fit_fuzzy(
    source: StrPath,
    output: StrPath,
    *,
    bind: StrPath | None = None,
    labels: StrPath | None = None,
    poses: StrPath | None = None,
    figure: StrPath | None = None,
    options: FitOptions = FitOptions(),
    overwrite: bool = False,
    on_progress: OnProgress | None = None,
) -> Result[Fitted]:
    """Fit a fuzzy system to the face of a shot, or of a rig with a binding, and write it.

    Parameters
    ----------
    source : path
        A shot; with `bind` a rig.
    output : path
        The system: .usda, .usdc, .fis, .fcl or .fll.
    bind : path, optional
        The binding of the rig, JSON.
    labels : path, optional
        Labelled takes to learn from; without them the rig's own expression poses count.
    poses : path, optional
        Also write the expression poses, JSON.
    figure : path, optional
        Also draw terms and confusions: .png, .svg or .pdf.
    options : FitOptions
    overwrite : bool
        Replace a USD file `output` also where it is no fuzzy system that usdface wrote.
    on_progress : callable, optional

    Returns
    -------
    Result of Fitted
        Keys of the summary: ``emotions``, ``rules``, ``fallback_rules``, ``inputs``,
        ``neutral_output_max``, with tested labels ``cross_validation``.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.

    Examples
    --------
    >>> usdface.fit_fuzzy("examples/shot.usda", "face.usda").value.system.emotions[0]
    'joy'
    """
    source, output = Path(source), Path(output)
    bind, labels, poses, figure = (Path(p) if p else None for p in (bind, labels, poses, figure))
    check_picture(figure)
    register_schemas()
    progress = Progress.of(on_progress)
    places = [output, *(path for path in (poses, figure) if path)]
    with progress.step("read"):
        check_outputs(places, files_read(source, bind, labels=labels))
        check_replaced([(output, "fuzzy system")], overwrite)
        face, setup, expressions, findings = _face(source, bind)
        stretches = read_labels(labels) if labels else ()
    if labels:
        labelled, new_findings = examples_of(
            stretches, face, setup, read=read_take, options=options, progress=progress
        )
        findings += new_findings
    with progress.step("fit"):
        fitted = (
            fit_labelled(labelled, face, options) if labels else fit_rig(face, expressions, options)
        )
    findings += fitted.findings
    with progress.step("write"), all_or_none():
        findings += write_fuzzy_file(output, fitted.system)
        if poses:
            write_text(poses, expressions_json(fitted.expressions))
        if figure:
            from usdface.figures.fit import write_fit_figure

            write_fit_figure(fitted.system, fitted.validation, figure)
    return Result(
        fitted,
        tuple(places),
        tuple(findings),
        fitted.summary,
        fitted.details,
        progress.seconds,
    )


def _face(
    source: Path, bind: Path | None
) -> tuple[BoundFace, RetargetSetup, tuple[Expression, ...], list[Finding]]:
    """Read the face of a shot, or of a rig and a binding, and its expression poses.

    Raises
    ------
    InputError
        If no marker is bound.
    """
    if bind is None:
        staged, findings = read_shot(open_shot(source), str(source))
        shot = staged.shot
        rig, setup, expressions = shot.rig, shot.setup, shot.expressions
    else:
        rig, _, findings = front_facing_rig(open_stage(source))
        setup, new_findings = read_bind(bind)
        expressions, pose_findings = expressions_for(rig.shape_names)
        findings += new_findings + pose_findings
        findings += assumed_mesh_findings(rig, setup.binding, str(bind))
    mesh = rig.mesh(setup.binding.mesh)
    setup, new_findings = fit_setup(setup, mesh)
    face = bound_face(mesh, setup, rig_shapes=rig.shape_names)
    if not face.markers:
        raise InputError(
            f"{bind or source}: no marker is bound, so there are no features for rules; bind "
            "markers (for a take of weights: those of `usdface markers`)"
        )
    return face, setup, expressions, findings + new_findings
