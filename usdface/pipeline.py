"""The order of work: one function per command, each a table of contents.

Readers and writers are imported by the function that needs them, so that a command loads
only the libraries it uses.
"""

from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from usdface.findings import Finding
from usdface.io.atomic import check_place
from usdface.options import (
    BindOptions,
    CorrectionOptions,
    ExportOptions,
    FitOptions,
    MarkerOptions,
    ProcessOptions,
    RigOptions,
    TakeOptions,
)
from usdface.outcome import OnStep, Outcome, Steps
from usdface.setup import Setup, fit_setup
from usdface.takes import MarkerTake, WeightsTake

if TYPE_CHECKING:
    from usdface.certificate import Certificate
    from usdface.explain import Explanation
    from usdface.fitting import Fitted
    from usdface.fuzzy.system import FuzzySystem
    from usdface.io.usd.stage import Stage
    from usdface.labelled import Face
    from usdface.resting import RestingAnswer
    from usdface.setup import Binding, Expression

__all__ = [
    "apply",
    "calibrate",
    "check",
    "convert_fuzzy",
    "explain",
    "export_scene",
    "fit_fuzzy",
    "import_scene",
    "make_markers",
    "make_rig",
    "make_shot",
    "make_take",
    "process",
    "resting",
]


def make_rig(
    source: Path, output: Path, options: RigOptions = RigOptions(), on_step: OnStep | None = None
) -> Outcome:
    """Convert a rig to UsdSkel: glTF, a folder of meshes, MakeHuman targets, or UsdSkel."""
    from usdface.io.rigs.files import read_rig_file
    from usdface.io.usd.rig_write import write_rig

    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        rig, findings = read_rig_file(source, options)
    with steps("write"):
        findings += write_rig(rig, output)
    summary = {
        "meshes": len(rig.meshes),
        "vertices": sum(len(mesh.points) for mesh in rig.meshes),
        "blend shapes": len(rig.shape_names),
        "joints": len(rig.skeleton.joints) if rig.skeleton else 0,
    }
    return Outcome((output,), tuple(findings), summary, steps.seconds)


def make_take(
    source: Path, output: Path, options: TakeOptions = TakeOptions(), on_step: OnStep | None = None
) -> Outcome:
    """Convert a take to USD: C3D, TRC, CSV, BVH or Live Link Face."""
    from usdface.io.takes.files import read_take
    from usdface.io.usd.take import write_take

    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        take, findings = read_take(source, options)
    with steps("write"):
        write_take(take, output)
    return Outcome((output,), tuple(findings), _take_summary(take), steps.seconds)


def _take_summary(take: MarkerTake | WeightsTake) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "frames": len(take.times),
        "seconds": round(float(take.times[-1]), 3),
        "rate Hz": round(take.rate, 3),
    }
    if isinstance(take, MarkerTake):
        hidden = 1.0 - float(take.visible.mean())
        return summary | {
            "markers": len(take.names),
            "dimension": take.dimension,
            "occluded %": round(100 * hidden, 2),
        }
    return summary | {"blend shapes": len(take.names)}


def make_shot(
    rig: Path,
    take: Path,
    bind: Path | None,
    output: Path,
    correction: CorrectionOptions | None = None,
    on_step: OnStep | None = None,
    fuzzy: Path | None = None,
    expressions_file: Path | None = None,
    binding: BindOptions = BindOptions(),
    calibration: Path | None = None,
) -> tuple[Outcome, Setup]:
    """Bring a rig and a take together, with expression poses and a fuzzy system for the rig.

    `bind` is the binding file; without one, places for the markers are proposed. `fuzzy` is a
    system to use in place of the default design, with its own correction unless one is given;
    `expressions_file` has poses that go before those of the dictionaries; `calibration` is what
    `calibrate` found of the performer. Returns the outcome and
    the setup as it was written (places, mesh and nose tip filled in).

    Raises
    ------
    InputError
        If the binding does not fit rig and take, or no places can be proposed.
    """
    from usdface.bound import bound_setup, proposal_summary
    from usdface.express import adopt, design, parts_of
    from usdface.fuzzy.dictionaries import expressions_for
    from usdface.fuzzy.doubts import rule_findings
    from usdface.io.calibration_file import read_calibration_file
    from usdface.io.expressions_file import read_expressions_file
    from usdface.io.fuzzy_formats.files import read_fuzzy_file
    from usdface.io.usd.rig import read_rig
    from usdface.io.usd.shot import write_shot
    from usdface.io.usd.stage import default_prim, open_stage
    from usdface.io.usd.take import read_take_prim

    _register_schemas()
    steps = Steps(on_step)
    files = [path for path in (bind, fuzzy, expressions_file, calibration) if path]
    check_place(output, rig, take, *files)
    with steps("read"):
        character, findings = read_rig(rig)
        stage = open_stage(take)
        recorded, _ = read_take_prim(default_prim(stage, take))
    with steps("bind"):
        mesh, named, more = bound_setup(character, recorded, bind, binding)
        findings += more
        if calibration:
            named = replace(named, calibration=read_calibration_file(calibration))
        setup, more = fit_setup(named, mesh, recorded)
        findings += more
    with steps("design"):
        given = read_expressions_file(expressions_file) if expressions_file else {}
        expressions, more = expressions_for(character.shape_names, given)
        findings += more
        system: FuzzySystem | None
        if fuzzy:
            system, more = read_fuzzy_file(fuzzy)
            findings += more + rule_findings(system)
            setup, more = adopt(system, setup, expressions, str(fuzzy))
            system = replace(system, **asdict(correction)) if correction else system
        else:
            system, setup, more = design(
                mesh, setup, expressions, correction or CorrectionOptions()
            )
        parts = parts_of(mesh, setup, expressions) if system else None
        findings += more
    with steps("write"):
        write_shot(output, rig, take, setup, system, expressions, parts)
    summary = {
        "markers bound": len(setup.binding.markers),
        **proposal_summary(setup),
        "blend shapes": len(character.shape_names),
        "expressions": ", ".join(e.name for e in expressions),
        "rules": len(system.rules) if system else 0,
    }
    return Outcome((output,), tuple(findings), summary, steps.seconds), setup


def make_markers(
    rig: Path,
    bind: Path | None = None,
    output: Path | None = None,
    options: MarkerOptions = MarkerOptions(),
    on_step: OnStep | None = None,
) -> tuple[Outcome, "Binding"]:
    """Find where the next markers on a face, or the first, would tell most of its blend shapes.

    `bind` has the markers that are there; the binding with the new ones goes to `output`, if that
    is given, and is returned.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.
    """
    from usdface.io.atomic import write_text
    from usdface.io.bind_file import bind_json, read_bind, setup_of_json
    from usdface.io.usd.rig import read_rig
    from usdface.marker_places import marker_places

    steps = Steps(on_step)
    if output:
        check_place(output, rig, *([bind] if bind else []))
    with steps("read"):
        character, findings = read_rig(rig)
        setup = read_bind(bind)[0] if bind else setup_of_json({"markers": {}}, str(rig))
        mesh = character.mesh(setup.binding.mesh)
        setup = fit_setup(setup, mesh)[0]
    with steps("place"):
        found = marker_places(mesh, setup.binding, options.count, options.noise)
    binding = found.binding(setup.binding)
    if output:
        write_text(output, bind_json(replace(setup, binding=binding)))
    rows = zip(binding.markers[-len(found.where) :], found.where, found.unseen, strict=True)
    summary: dict[str, Any] = {
        "markers there": len(setup.binding.markers),
        "blend shapes hardly seen": len(found.unseen_before),
    }
    summary |= {name: f"{where}; then {len(rest)} hardly seen" for name, where, rest in rows}
    details = {
        "vertices": found.vertices.tolist(),
        "hardly seen": {"before": found.unseen_before, "after": found.unseen[-1]},
    }
    written = (output,) if output else ()
    return Outcome(written, tuple(findings), summary, steps.seconds, details), binding


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
    from usdface.animate import animate
    from usdface.clips import Clip
    from usdface.io.usd.layers import layer_paths, write_layers
    from usdface.io.usd.shot import read_shot
    from usdface.io.usd.stage import files_of, open_stage

    path = Path(path)
    root = Path(options.output) if options.output else None
    gltf = Path(options.gltf) if options.gltf else None
    figure = Path(options.figure) if options.figure else None
    if figure:
        from usdface.picture import check_picture
        from usdface.take_figure import write_take_figure

        check_picture(figure)
    if gltf:
        from usdface.io.gltf.write import write_gltf
        from usdface.io.head_clip import head_clip
    _register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        ours = layer_paths(path, root)
        stage = open_stage(path, without=(ours.solve, ours.express))
        for place in (ours.root, ours.solve, gltf, figure):
            if place:
                check_place(place, *files_of(stage))
        shot, findings = read_shot(stage, str(path))
    solved = animate(stage, shot, options, steps)
    findings += solved.findings
    if gltf:
        with steps("gltf"):
            rig, clip = shot.rig, Clip(Path(solved.weights.source).stem or "take", solved.weights)
            if solved.solve.motion is not None and shot.prims.head is not None:
                head = shot.prims.head.joint, solved.solve.motion, shot.take.times
                rig, joints = head_clip(rig, *head)
                clip = replace(clip, joints=joints)
            findings += write_gltf(rig, gltf, (clip,))
    with steps("write"):
        written = write_layers(
            path, stage, shot, solved.solve, solved.express, root, options.in_place
        )
    if figure:
        with steps("draw"):
            write_take_figure(solved, figure)
    written += [place for place in (gltf, figure) if place]
    return Outcome(tuple(written), tuple(findings), solved.summary, steps.seconds, solved.details)


def calibrate(
    path: Path, output: Path, extremes: bool = False, on_step: OnStep | None = None
) -> Outcome:
    """Find how large a performer's movements are against the character's, and write it as JSON.

    `path` is a shot of an expressive take; with `extremes` one that goes through the whole range of
    motion, each movement to its extreme.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.
    """
    from usdface.animate import calibrate as calibrate_face
    from usdface.io.atomic import write_text
    from usdface.io.calibration_file import calibration_json
    from usdface.io.usd.layers import layer_paths
    from usdface.io.usd.shot import read_shot
    from usdface.io.usd.stage import files_of, open_stage

    _register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        ours = layer_paths(path, None)
        stage = open_stage(path, without=(ours.solve, ours.express))
        check_place(output, *files_of(stage))
        shot, findings = read_shot(stage, str(path))
    with steps("calibrate"):
        mesh = shot.rig.mesh(shot.setup.binding.mesh)
        found, more = calibrate_face(shot.take, shot.setup, mesh, extremes)
    with steps("write"):
        text = calibration_json(found.calibration, found.deviations, found.peaks)
        write_text(output, text)
    summary = {
        "frames": len(shot.take.times),
        "blend shapes": len(found.calibration.shapes),
        "gains known": len(found.known),
        **found.summary(),
    }
    return Outcome((output,), tuple(findings + more), summary, steps.seconds)


def apply(
    stage: "Stage", options: ProcessOptions = ProcessOptions(), on_step: OnStep | None = None
) -> Outcome:
    """Do the main job on a stage that a host holds open: author on its edit target.

    The final weights, emotion curves and residual go onto the edit target; nothing is saved.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is authored.
    """
    from usdface.animate import animate
    from usdface.io.usd.layers import apply_animation
    from usdface.io.usd.shot import read_shot

    steps = Steps(on_step)
    with steps("read"):
        shot, findings = read_shot(stage, stage.GetRootLayer().identifier)
    solved = animate(stage, shot, options, steps)
    with steps("write"):
        solve = solved.solve
        final = replace(
            solved.final, solution=solve.solution, repairs=solve.repairs, motion=solve.motion
        )
        apply_animation(stage, shot, final)
    return Outcome(
        (), tuple(findings + solved.findings), solved.summary, steps.seconds, solved.details
    )


def explain(path: Path, on_step: OnStep | None = None) -> "Explanation":
    """Process a shot without writing, and keep what its corrector saw and did.

    Raises
    ------
    InputError
        If the shot cannot be processed or has no fuzzy system.
    """
    from usdface.explain import explain_shot

    _register_schemas()
    return explain_shot(path, Steps(on_step))


def resting(path: Path, on_step: OnStep | None = None) -> "tuple[RestingAnswer, ...]":
    """Ask the fuzzy paper's system and that of a shot about a neutral face.

    Raises
    ------
    InputError
        If the shot cannot be read or has no fuzzy system.
    """
    from usdface.resting import resting_answers

    _register_schemas()
    return resting_answers(path, Steps(on_step))


def export_scene(
    source: Path,
    output: Path,
    on_step: OnStep | None = None,
    every_frame: bool = False,
    options: ExportOptions = ExportOptions(),
) -> Outcome:
    """Write the face of a USD scene, with all of its clips, as glTF or USDZ.

    A certificate says by how much the glTF is off; its vertices are compared in as many frames
    as take a fraction of a second, or in every frame.
    """
    steps = Steps(on_step)
    check_place(output, source)
    if output.suffix.lower() == ".usdz":
        from usdface.io.usd.usdz import write_usdz

        with steps("write"):
            return Outcome((output,), tuple(write_usdz(source, output)), {}, steps.seconds)
    from usdface.clips import chosen_clips
    from usdface.io.certified import certified
    from usdface.io.gltf.write import write_gltf
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.stage import open_stage

    _register_schemas()
    with steps("read"):
        stage = open_stage(source)
        rig, clips, findings = animated_rig(stage)
        clips = chosen_clips(clips, options.clip)
    summary = {
        "meshes": len(rig.meshes),
        "morph targets": len(rig.shape_names),
        "clips": len(clips),
        "frames": sum(len(clip.times) for clip in clips),
    }
    with steps("write"):
        findings += write_gltf(rig, output, clips, options.pointer, options.quantize)
    del rig, clips  # their memory, for the certificate
    with steps("certify"):
        certificate, more = certified(
            stage, output, exported=True, every_frame=every_frame, clip=options.clip
        )
    return _certified((output,), findings + more, summary, steps, certificate)


def import_scene(
    source: Path, output: Path, on_step: OnStep | None = None, every_frame: bool = False
) -> Outcome:
    """Write a glTF as USD: meshes, blend shapes, skin, materials and all of its animations.

    A certificate says by how much the USD is off (see `export_scene`).
    """
    from usdface.io.certified import certified
    from usdface.io.gltf.read import read_gltf
    from usdface.io.usd.rig_write import write_rig
    from usdface.io.usd.stage import open_stage

    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        rig, clips, findings = read_gltf(source)
    summary = {
        "meshes": len(rig.meshes),
        "blend shapes": len(rig.shape_names),
        "clips": len(clips),
        "frames": sum(len(clip.times) for clip in clips),
    }
    with steps("write"):
        findings += write_rig(rig, output, clips)
    del rig, clips  # their memory, for the certificate
    with steps("certify"):
        stage = open_stage(output)
        certificate, more = certified(stage, source, exported=False, every_frame=every_frame)
    return _certified((output,), findings + more, summary, steps, certificate)


def _certified(
    written: tuple[Path, ...],
    findings: list[Finding],
    summary: dict[str, Any],
    steps: Steps,
    certificate: "Certificate | None",
) -> Outcome:
    details = {}
    if certificate is not None:
        summary["off by"] = certificate.line()
        details["certificate"] = certificate.as_dict()
    return Outcome(written, tuple(findings), summary, steps.seconds, details)


def convert_fuzzy(source: Path, output: Path, on_step: OnStep | None = None) -> Outcome:
    """Convert a fuzzy system between .fis, FCL, FLL and USD; say what is doubtful in it."""
    from usdface.fuzzy.doubts import rule_findings
    from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file

    _register_schemas()
    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        system, findings = read_fuzzy_file(source)
        findings += rule_findings(system)
    with steps("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.inputs),
        "outputs": len(system.outputs),
        "terms": sum(len(v.terms) for v in system.variables),
        "rules": len(system.rules),
        "inference": system.inference,
    }
    return Outcome((output,), tuple(findings), summary, steps.seconds)


def fit_fuzzy(
    source: Path,
    output: Path,
    options: FitOptions = FitOptions(),
    on_step: OnStep | None = None,
    bind: Path | None = None,
    labels: Path | None = None,
    poses: Path | None = None,
) -> "tuple[Outcome, Fitted]":
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
    from usdface.fitting import fit_labelled, fit_rig
    from usdface.io.atomic import write_text
    from usdface.io.expressions_file import expressions_json
    from usdface.io.fuzzy_formats.files import write_fuzzy_file
    from usdface.io.labels_file import read_labels
    from usdface.io.takes.any_take import read_any_take
    from usdface.labelled import examples_of

    _register_schemas()
    steps = Steps(on_step)
    given = [source, *(path for path in (bind, labels) if path)]
    for place in (output, *([poses] if poses else [])):
        check_place(place, *given)
    with steps("read"):
        face, expressions, findings = _face(source, bind)
        stretches = read_labels(labels) if labels else ()
    if labels:
        labelled, more = examples_of(stretches, face, read_any_take, options, steps)
        findings += more
    with steps("fit"):
        fitted = (
            fit_labelled(labelled, face, options) if labels else fit_rig(face, expressions, options)
        )
    with steps("write"):
        findings += write_fuzzy_file(output, fitted.system)
        if poses:
            write_text(poses, expressions_json(fitted.expressions))
    written = (output, *([poses] if poses else []))
    findings += fitted.findings
    outcome = Outcome(written, tuple(findings), fitted.summary, steps.seconds, fitted.details)
    return outcome, fitted


def _face(source: Path, bind: Path | None) -> "tuple[Face, tuple[Expression, ...], list[Finding]]":
    """Read the face of a shot, or of a rig and a binding, with its expression poses."""
    from usdface.fuzzy.dictionaries import expressions_for
    from usdface.io.bind_file import read_bind
    from usdface.io.usd.layers import layer_paths
    from usdface.io.usd.rig import read_rig
    from usdface.io.usd.shot import read_shot
    from usdface.io.usd.stage import open_stage
    from usdface.labelled import Face

    if bind is None:
        ours = layer_paths(source, None)
        shot, findings = read_shot(
            open_stage(source, without=(ours.solve, ours.express)), str(source)
        )
        rig, setup, expressions = shot.rig, shot.setup, shot.expressions
    else:
        rig, findings = read_rig(source)
        setup, more = read_bind(bind)
        expressions, _ = expressions_for(rig.shape_names)
        findings += more
    mesh = rig.mesh(setup.binding.mesh)
    setup, more = fit_setup(setup, mesh)
    return Face(mesh, rig.shape_names, setup), expressions, findings + more


def check(paths: list[Path], on_step: OnStep | None = None) -> Outcome:
    """Check blend shapes and their animation beyond what the standard validators look at."""
    from usdface.io.check import check_file

    _register_schemas()
    steps = Steps(on_step)
    findings: list[Finding] = []
    for path in paths:
        with steps(f"check {path.name}"):
            findings += check_file(path)
    summary = {"files": len(paths), "findings": len(findings)}
    return Outcome((), tuple(findings), summary, steps.seconds)


def _register_schemas() -> None:
    """Let USD know our prim types; in a host where it is too late, reading works without."""
    from usdface.errors import SchemaError
    from usdface.schemas import register

    with suppress(SchemaError):
        register()
