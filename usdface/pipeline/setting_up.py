"""Authoring the setup of a shot on an open stage."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.expression_poses import ActionPose
from usdface.face.head_size import report_size
from usdface.face.stray_vertices import report_stray
from usdface.io.atomic import StrPath
from usdface.io.bind_file import read_bind
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.shot_write import author_shot
from usdface.io.usd.stage import Stage
from usdface.io.usd.take import read_take_prim
from usdface.options import BindOptions, CorrectionOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.schemas import tokens
from usdface.setup.calibration import Calibration
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup
from usdface.setup.setup_summary import bound_count
from usdface.shot.assembly import assemble_shot
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["set_up"]


@checked
@one_blas_thread()
def set_up(
    stage: Stage,
    *,
    take: str | MarkerTake | WeightsTake,
    rig: str = "",
    bind: StrPath | RetargetSetup | None = None,
    binding: BindOptions = BindOptions(),
    calibration: Calibration | None = None,
    poses: Mapping[str, Expression | ActionPose | None] | None = None,
    system: ExpressionSystem | None = None,
    correction: CorrectionOptions | Mapping[str, Any] | None = None,
    scope: str = "/UsdFace",
    start_code: float = 0.0,
    on_progress: OnProgress | None = None,
) -> Result[Shot]:
    """Author the setup of a shot on a stage that a host holds open, for `apply`.

    The prims go onto the edit target; nothing is saved. A setup that was authored at `scope`
    before is replaced.

    Parameters
    ----------
    stage : Usd.Stage
        With the character; it need not be a file.
    take : str, MarkerTake or WeightsTake
        The path of a take's prim on the stage, or a take to author below `scope`.
    rig : str
        Path of the SkelRoot; "" where there is one.
    bind : path or RetargetSetup, optional
        The binding; without one, places for the markers are proposed.
    binding : BindOptions
    calibration, poses, system, correction
        As of `assemble_shot`.
    scope : str
        Path of the prim that is to hold the setup.
    start_code : float
        Time code of the first frame of a take that is authored.
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is authored.

    Returns
    -------
    Result of Shot

    Raises
    ------
    InputError
        If rig, take and binding do not belong together, or the stage has a setup elsewhere.
    OutputError
        If the edit target cannot be authored on; then nothing is.

    Examples
    --------
    >>> stage = Usd.Stage.Open("examples/head.usdc", Usd.Stage.LoadAll)
    >>> stage.SetEditTarget(stage.GetSessionLayer())
    >>> take, _ = usdface.read_take("examples/take.usdc")
    >>> shot = usdface.set_up(stage, take=take, bind="examples/bind.json").value
    >>> usdface.apply(stage).summary["frames"]
    720
    """
    register_schemas()
    progress = Progress.of(on_progress)
    where = stage.GetRootLayer().identifier
    with progress.step("read"):
        _refuse_other_setups(stage, scope)
        character, _, findings = front_facing_rig(stage, rig, joints=True)
        findings += report_size(character) + report_stray(character)
        recorded = _take_at(stage, take) if isinstance(take, str) else take
        bind_file = ""
        if bind is None or isinstance(bind, RetargetSetup):
            setup = bind
        else:
            bind_file = str(bind)
            setup, new_findings = read_bind(Path(bind))
            findings += new_findings
    with progress.step("bind"):
        shot, new_findings = assemble_shot(
            character,
            recorded,
            setup=setup,
            setup_source=bind_file,
            binding=binding,
            calibration=calibration,
            poses=poses,
            system=system,
            system_source=where,
            correction=correction,
        )
    with progress.step("write"):
        author_shot(stage, scope, shot, take if isinstance(take, str) else "", start_code)
    summary = {"markers_bound": bound_count(shot.setup, shot.take), "scope": scope}
    return Result(shot, (), (*findings, *new_findings), summary, seconds=progress.seconds)


def _refuse_other_setups(stage: Stage, scope: str) -> None:
    for prim in stage.Traverse():
        path = str(prim.GetPath())
        if prim.GetTypeName() == tokens.RETARGET and not path.startswith(f"{scope}/"):
            raise InputError(
                f"the stage has a setup at <{path}> already; name its scope, or remove it",
                "SETTING_WRONG",
            )


def _take_at(stage: Stage, path: str) -> MarkerTake | WeightsTake:
    prim = stage.GetPrimAtPath(path)
    if not prim:
        raise InputError(
            f"there is no take at <{path}> on the stage; reference one there, as `usdface take` "
            "writes it, or give the take of a file: usdface.read_take(path)",
            "SHOT_INCOMPLETE",
        )
    return read_take_prim(prim)[0]
