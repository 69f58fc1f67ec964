"""Writing a shot from a rig and a take: `usdface shot`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.binding.resolved_binding import UnsureBindingError
from usdface.blas_threads import one_blas_thread
from usdface.face.head_size import report_size
from usdface.face.stray_vertices import report_stray
from usdface.figures.picture import check_picture
from usdface.findings import Finding
from usdface.io.atomic import StrPath, all_or_none, write_text
from usdface.io.bind_file import bind_json, read_bind
from usdface.io.calibration_file import read_calibration_file
from usdface.io.expressions_file import read_expressions_file
from usdface.io.fuzzy_formats.files import read_fuzzy_file
from usdface.io.inputs import check_outputs, files_read
from usdface.io.overwrite_protection import check_replaced
from usdface.io.takes.usd_take import read_usd_take
from usdface.io.usd.save_layers import check_usd_name
from usdface.io.usd.shared_layers import SharedLayers
from usdface.io.usd.shot import read_character
from usdface.io.usd.shot_write import write_shot
from usdface.options import BindOptions, CorrectionOptions, TakeOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rigs import Mesh, Rig
from usdface.setup.retarget_setup import RetargetSetup
from usdface.setup.setup_summary import bound_count, proposal_summary
from usdface.shot.assembly import assemble_shot
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["make_shot"]


@checked
@one_blas_thread()
def make_shot(
    rig: StrPath,
    take: StrPath,
    output: StrPath,
    *,
    bind: StrPath | None = None,
    binding: BindOptions = BindOptions(),
    calibration: StrPath | None = None,
    expressions: StrPath | None = None,
    fuzzy: StrPath | None = None,
    correction: CorrectionOptions | Mapping[str, Any] | None = None,
    write_bind: StrPath | None = None,
    figure: StrPath | None = None,
    performer_layer: StrPath | None = None,
    character_layer: StrPath | None = None,
    overwrite: bool = False,
    on_progress: OnProgress | None = None,
) -> Result[Shot]:
    """Write a shot: a rig and a take brought together, with expressions and a fuzzy system.

    Parameters
    ----------
    rig, take : path
        USD files, as `make_rig` and `make_take` write them.
    output : path
        The shot, .usda, which references them.
    bind : path, optional
        The binding, JSON; without one, places for the markers are proposed.
    binding : BindOptions
    calibration : path, optional
        Of the performer, as `calibrate` writes it.
    expressions : path, optional
        Expression poses that override the known ones, JSON or USD.
    fuzzy : path, optional
        A fuzzy system in place of one designed for the rig: USD, .fis, .fcl or .fll.
    correction : CorrectionOptions or mapping, optional
        In place of the settings of the system; a mapping of some of the fields overrides these.
    write_bind : path, optional
        Also write the binding as it is used, and the places that are too unsure to be, JSON;
        also where most of them are, and no shot is written.
    figure : path, optional
        Also draw the markers on the face: .png, .svg or .pdf.
    performer_layer, character_layer : path, optional
        Layers that the shot sublayers: the performer's with the calibration; the character's with
        rig, binding, expressions and fuzzy system. One that is not there is written; one that is
        stays as it is, also where it differs (`LAYER_KEPT`).
    overwrite : bool
        Replace `output` and `write_bind` also where they were edited since usdface wrote them, or
        are of another origin.
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is written.

    Returns
    -------
    Result of Shot
        Its `setup` is as written: places, mesh and nose tip filled in. Keys of the summary:
        ``markers_bound``, ``blend_shapes``, ``expressions``, ``rules``, and where places were
        proposed ``neutral_frames``, ``peak_frames``, ``confidence_mean``, ``confidence_min``.

    Raises
    ------
    InputError
        If the binding does not fit rig and take, or no places can be proposed; with the code
        BINDING_UNSURE if most of them are unsure.
    OutputError
        If an output was edited or is of another origin and `overwrite` is not set, or it cannot be
        written.

    Examples
    --------
    >>> result = usdface.make_shot(
    ...     "examples/head.usdc", "examples/take.usdc", "shot.usda", bind="examples/bind.json"
    ... )
    >>> result.summary["markers_bound"] == len(result.value.setup.binding.markers)
    True
    """
    register_schemas()
    progress = Progress.of(on_progress)
    rig, take = Path(rig), Path(take)
    shared = SharedLayers(*(Path(p) if p else None for p in (performer_layer, character_layer)))
    outputs = _Outputs(
        Path(output), shared, Path(write_bind) if write_bind else None,
        Path(figure) if figure else None,
    )  # fmt: skip
    files = [Path(path) for path in (bind, fuzzy, expressions, calibration) if path]
    outputs.check([rig, take, *files], overwrite)
    with progress.step("read"):
        character, recorded, findings = _read(rig, take)
        setup, new_findings = read_bind(Path(bind)) if bind else (None, [])
        findings += new_findings
        system, new_findings = read_fuzzy_file(Path(fuzzy)) if fuzzy else (None, [])
        findings += new_findings
    try:
        with progress.step("bind"):
            shot, new_findings = assemble_shot(
                character,
                recorded,
                setup=setup,
                setup_source=str(bind or ""),
                binding=binding,
                calibration=read_calibration_file(Path(calibration)) if calibration else None,
                poses=read_expressions_file(Path(expressions)) if expressions else None,
                system=system,
                system_source=str(fuzzy or ""),
                correction=correction,
            )
            findings += new_findings
    except UnsureBindingError as error:
        with all_or_none():
            outputs.write_binding(error.mesh, error.setup)
        raise
    with progress.step("write"), all_or_none():
        written, kept = write_shot(outputs.shot, rig, take, shot, shared, rules=str(fuzzy or ""))
        outputs.write_binding(shot.mesh, shot.setup)
    written, findings = [*written, *outputs.beside], [*findings, *kept]
    return Result(shot, tuple(written), tuple(findings), _summary(shot), seconds=progress.seconds)


@dataclass(frozen=True, slots=True)
class _Outputs:
    """The output files of `usdface shot`; None: not written."""

    shot: Path
    shared: SharedLayers
    bind: Path | None
    figure: Path | None

    @property
    def beside(self) -> tuple[Path, ...]:
        """The files beside the layers."""
        return tuple(filter(None, (self.bind, self.figure)))

    def check(self, read: Sequence[Path], overwrite: bool) -> None:
        """Refuse names that are none of their formats, and files that must not be replaced."""
        check_usd_name(self.shot)
        layers = (self.shared.performer, self.shared.character)
        new = [layer for layer in layers if layer and not layer.exists()]
        check_outputs([self.shot, *new, *self.beside], files_read(*read))
        check_replaced([(self.shot, "shot"), (self.bind, "binding")], overwrite)
        check_picture(self.figure)

    def write_binding(self, mesh: Mesh, setup: RetargetSetup) -> None:
        """Write the binding of a setup, and draw it with its unsure places, if that is wanted."""
        if self.bind:
            write_text(self.bind, bind_json(setup))
        if self.figure:
            from usdface.figures.binding import write_bind_figure

            write_bind_figure(mesh, setup.binding, self.figure, unsure=setup.unsure)


def _read(rig: Path, take: Path) -> tuple[Rig, MarkerTake | WeightsTake, list[Finding]]:
    """Read character and take."""
    character, findings = read_character(rig)
    findings += report_size(character) + report_stray(character)
    recorded, unread = read_usd_take(take, TakeOptions())
    return character, recorded, findings + unread


def _summary(shot: Shot) -> dict[str, Any]:
    return {
        "markers_bound": bound_count(shot.setup, shot.take),
        **proposal_summary(shot.setup),
        "blend_shapes": len(shot.rig.shape_names),
        "expressions": [expression.name for expression in shot.expressions],
        "rules": len(shot.system.fuzzy.rules) if shot.system else 0,
    }
