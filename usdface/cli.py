"""The command line: parses, calls `usdface.pipeline`, prints; exit status 0, 1 or 2.

Nothing heavy is imported until a command runs, so that `usdface --help` answers at once.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from usdface import __version__
from usdface.errors import InputError, OutputError, UsdFaceError
from usdface.findings import severest
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

if TYPE_CHECKING:
    from usdface.outcome import OnStep, Outcome

__all__ = ["main"]

DONE, FAILED, USAGE = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit status (argparse exits with 2 on wrong usage)."""
    parsed = _parser().parse_args(arguments)
    try:
        if parsed.report:
            _check_report(parsed)
        status: int = parsed.run(parsed)
        return status
    except UsdFaceError as error:
        if parsed.debug:
            raise
        print(f"usdface: {error} [{error.code}]", file=sys.stderr)
        if getattr(parsed, "format", "") == "json":
            print(json.dumps({"error": {"code": error.code, "message": str(error)}}))
        return FAILED
    except BrokenPipeError:
        return FAILED
    except KeyboardInterrupt:
        print("usdface: interrupted", file=sys.stderr)
        return FAILED
    except OSError as error:  # a name too long, a folder that may not be entered, a full disk
        if parsed.debug:
            raise
        where = f"{error.filename}: " if error.filename else ""
        print(f"usdface: {where}{error.strerror or error}", file=sys.stderr)
        return FAILED
    except Exception as error:
        if parsed.debug:
            raise
        said = f"{type(error).__name__}: {error}".splitlines()[0]
        print(f"usdface: a mistake in usdface: {said}; --debug shows where", file=sys.stderr)
        return FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="usdface",
        description="Marker takes onto blend-shape characters, in USD and glTF.",
        epilog="exit status: 0 done, 1 an error (one line says which), 2 wrong usage",
    )
    parser.add_argument("--version", action="version", version=f"usdface {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    first = _rig, _take, _markers, _shot, _calibrate, _process
    for add in (*first, _export, _import, _check, _fuzzy, _bench):
        add(commands)
    return parser


def _command(
    commands: Any, name: str, run: Callable[[argparse.Namespace], int], summary: str
) -> argparse.ArgumentParser:
    command: argparse.ArgumentParser = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    command.add_argument("--format", choices=("text", "json"), default="text", help="of the report")
    command.add_argument("--report", type=Path, metavar="FILE.json", help="also write it as JSON")
    command.add_argument("--strict", action="store_true", help="a warning is a failure")
    command.add_argument("--debug", action="store_true", help="show tracebacks")
    return command


def _rig(commands: Any) -> None:
    command = _command(commands, "rig", _run_rig, "convert a character to UsdSkel")
    command.add_argument(
        "source", type=Path, help="glTF/GLB, a folder of OBJ/PLY or MakeHuman targets, UsdSkel"
    )
    _output(command, "the rig, .usda or .usdc")
    default = RigOptions()
    command.add_argument("--neutral", default="", help="neutral mesh of a folder")
    command.add_argument(
        "--meters-per-unit",
        type=float,
        default=default.meters_per_unit,
        help="unit of OBJ and PLY files (default: %(default)s, centimetres)",
    )
    command.add_argument("--up-axis", choices=("Y", "Z"), default=default.up_axis)


def _run_rig(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import make_rig

    options = RigOptions(**_settings(parsed, RigOptions))
    return _report(parsed, lambda step: make_rig(parsed.source, parsed.output, options, step))


def _take(commands: Any) -> None:
    command = _command(commands, "take", _run_take, "convert a recorded take to USD")
    command.add_argument("source", type=Path, help="C3D, TRC, CSV, BVH or Live Link Face CSV")
    _output(command, "the take, .usda or .usdc")
    command.add_argument("--units", choices=("mm", "cm", "m", "in"), help="override the file's")
    command.add_argument("--up-axis", choices=("Y", "Z"), help="override the file's")
    command.add_argument("--rate", type=float, help="frames per second; override the file's")
    command.add_argument(
        "--dimension", type=int, choices=(2, 3), help="2: pixels of an image, y down"
    )
    command.add_argument(
        "--image-size", type=int, nargs=2, metavar=("WIDTH", "HEIGHT"), help="[px], for 2D"
    )


def _run_take(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import make_take

    if parsed.image_size:
        parsed.image_size = tuple(parsed.image_size)
    options = TakeOptions(**_settings(parsed, TakeOptions))
    return _report(parsed, lambda step: make_take(parsed.source, parsed.output, options, step))


def _shot(commands: Any) -> None:
    command = _command(commands, "shot", _run_shot, "bring a rig and a take together")
    command.add_argument("--rig", type=Path, required=True, help="USD rig")
    command.add_argument("--take", type=Path, required=True, help="USD take")
    command.add_argument(
        "--bind", type=Path, help="where the markers sit, JSON (without: places are proposed)"
    )
    command.add_argument(
        "--propose", action="store_true", help="propose places for the markers --bind leaves out"
    )
    command.add_argument(
        "--neutral",
        nargs="+",
        metavar="FRAME",
        help='first and last neutral frame index, or "auto"; instead of the binding\'s',
    )
    command.add_argument(
        "--peaks",
        nargs="+",
        metavar="FRAME",
        help='frame indices of strong expressions to propose by, or "auto"; instead of the '
        "binding's",
    )
    command.add_argument(
        "--write-bind", type=Path, metavar="FILE.json", help="write the binding, to correct it"
    )
    command.add_argument(
        "--bind-figure", type=Path, metavar="FILE", help="draw the markers on the face: .png, ..."
    )
    command.add_argument(
        "--print-bind",
        action="store_true",
        help="print the binding as written; the report goes to standard error",
    )
    _output(command, "the shot, .usda")
    default = CorrectionOptions()
    command.add_argument(
        "--fuzzy",
        type=Path,
        metavar="FILE",
        help="a fuzzy system to use, .usda, .fis, .fcl or .fll (default: designed for the rig)",
    )
    command.add_argument(
        "--expressions",
        type=Path,
        metavar="FILE",
        help="expressions to use, also new ones: shapes or action units as JSON, or USD",
    )
    command.add_argument(
        "--calibration", type=Path, metavar="FILE.json", help="of the performer, by calibrate"
    )
    command.add_argument(
        "--mode",
        choices=("raise", "add"),
        help=f"how emotions go over the solved weights (default: {default.mode}, or the system's)",
    )
    command.add_argument(
        "--gain", type=float, help=f"their strength (default: {default.gain:g}, or the system's)"
    )
    command.add_argument(
        "--ease",
        type=float,
        default=default.ease,
        help="how far shapes that oppose what is raised go back, 0 to 1 (default: %(default)s)",
    )


def _run_shot(parsed: argparse.Namespace) -> int:
    from usdface.io.atomic import check_place, write_bytes
    from usdface.io.bind_file import bind_json
    from usdface.pipeline import make_shot

    given = {k: v for k, v in _settings(parsed, CorrectionOptions).items() if v is not None}
    correction = CorrectionOptions(**given) if given else None
    neutral = _frames("--neutral", parsed.neutral, "one or two frame indices", 2)
    peaks = _frames("--peaks", parsed.peaks, "frame indices")
    if isinstance(neutral, tuple):
        neutral = neutral[0], neutral[-1]
    binding = BindOptions(propose=parsed.propose, neutral=neutral, peaks=peaks)
    setups = []

    def run(step: "OnStep | None") -> "Outcome":
        outcome, setup = make_shot(
            parsed.rig,
            parsed.take,
            parsed.bind,
            parsed.output,
            correction,
            step,
            parsed.fuzzy,
            parsed.expressions,
            binding,
            parsed.calibration,
        )
        setups.append(setup)
        return outcome

    others = (parsed.rig, parsed.take, parsed.output, *([parsed.bind] if parsed.bind else []))
    for place in (parsed.write_bind, parsed.bind_figure):
        if place:
            check_place(place, *others)
    status = _report(parsed, run, file=sys.stderr if parsed.print_bind else None)
    if parsed.print_bind:
        print(bind_json(setups[0]), end="")
    if parsed.write_bind:
        write_bytes(parsed.write_bind, bind_json(setups[0]).encode())
    if parsed.bind_figure:
        from usdface.bind_figure import write_bind_figure
        from usdface.io.usd.rig import read_rig

        character, _ = read_rig(parsed.rig)
        binding_made = setups[0].binding
        write_bind_figure(character.mesh(binding_made.mesh), binding_made, parsed.bind_figure)
    return status


def _frames(option: str, words: list[str] | None, expected: str, most: int = 1000) -> Any:
    """Return what an option says: frame indices, "auto" or None."""
    if words is None or words == ["auto"]:
        return words and "auto"
    if len(words) > most or not all(word.isdecimal() and len(word) < 10 for word in words):
        raise InputError(f'{option} is {" ".join(words)!r}; expected {expected}, or "auto"')
    return tuple(int(word) for word in words)


def _markers(commands: Any) -> None:
    summary = "find where markers would tell most of a character's blend shapes"
    command = _command(commands, "markers", _run_markers, summary)
    command.add_argument("rig", type=Path, help="USD rig")
    default = MarkerOptions()
    command.add_argument(
        "-n",
        "--count",
        type=int,
        default=default.count,
        help="how many markers (default: %(default)s)",
    )
    command.add_argument("--bind", type=Path, help="the markers that are there, JSON")
    command.add_argument(
        "--noise",
        type=float,
        default=default.noise,
        help="of a marker coordinate [m] (default: %(default)s)",
    )
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="the binding with the new markers"
    )
    command.add_argument("--figure", type=Path, metavar="FILE", help="draw them: .png, .svg, .pdf")


def _run_markers(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import make_markers

    options = MarkerOptions(**_settings(parsed, MarkerOptions))
    bindings = []

    def run(step: "OnStep | None") -> "Outcome":
        outcome, binding = make_markers(parsed.rig, parsed.bind, parsed.output, options, step)
        bindings.append(binding)
        return outcome

    if parsed.figure:
        from usdface.picture import check_picture

        check_picture(parsed.figure)
    status = _report(parsed, run)
    if parsed.figure:
        from usdface.bind_figure import write_bind_figure
        from usdface.io.usd.rig import read_rig

        mesh = read_rig(parsed.rig)[0].mesh(bindings[0].mesh)
        write_bind_figure(mesh, bindings[0], parsed.figure)
    return status


def _calibrate(commands: Any) -> None:
    summary = "find how large a performer's movements are against the character's"
    command = _command(commands, "calibrate", _run_calibrate, summary)
    command.add_argument("shot", type=Path, help="a shot of an expressive take")
    _output(command, "the calibration, .json, for shot --calibration")
    command.add_argument(
        "--extremes",
        action="store_true",
        help="the take is a range of motion: each movement goes to its extreme",
    )


def _run_calibrate(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import calibrate

    return _report(
        parsed, lambda step: calibrate(parsed.shot, parsed.output, parsed.extremes, step)
    )


def _process(commands: Any) -> None:
    command = _command(commands, "process", _run_process, "retarget, correct, write layers")
    command.add_argument("shot", type=Path)
    command.add_argument("--gltf", default="", metavar="FILE", help="also write .glb or .gltf")
    command.add_argument(
        "--figure", default="", metavar="FILE", help="also draw the take: .png, .svg or .pdf"
    )
    command.add_argument("--no-express", dest="express", action="store_false")
    command.add_argument(
        "--no-head", dest="head", action="store_false", help="the character's head stays still"
    )
    command.add_argument(
        "--no-clean", dest="clean", action="store_false", help="solve the markers as recorded"
    )
    command.add_argument(
        "--solve",
        choices=("take", "frame"),
        help="all frames together or each alone (default: as the shot says)",
    )
    result = command.add_mutually_exclusive_group()
    result.add_argument("-o", "--output", default="", metavar="ROOT", help="the result to open")
    result.add_argument(
        "--in-place", action="store_true", help="add the layers to the shot's own subLayers"
    )


def _run_process(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import process

    options = ProcessOptions(**_settings(parsed, ProcessOptions))
    return _report(parsed, lambda step: process(parsed.shot, options, step))


def _export(commands: Any) -> None:
    command = _command(commands, "export", _run_export, "write a USD scene as glTF or USDZ")
    command.add_argument("scene", type=Path)
    _output(command, ".glb, .gltf or .usdz")
    command.add_argument("--clip", default="", metavar="NAME", help="only this one of the clips")
    command.add_argument(
        "--pointer",
        action="store_true",
        help="a channel for each weight, too, by KHR_animation_pointer",
    )
    command.add_argument(
        "--quantize",
        action="store_true",
        help="points, normals and texture coordinates as 16-bit integers, by KHR_mesh_quantization",
    )


def _run_export(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import export_scene

    every = bool(parsed.report or parsed.strict)
    options = ExportOptions(**_settings(parsed, ExportOptions))
    return _report(
        parsed, lambda step: export_scene(parsed.scene, parsed.output, step, every, options)
    )


def _import(commands: Any) -> None:
    command = _command(commands, "import", _run_import, "write a glTF as USD")
    command.add_argument("source", type=Path)
    _output(command, ".usda or .usdc")


def _run_import(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import import_scene

    every = bool(parsed.report or parsed.strict)
    return _report(parsed, lambda step: import_scene(parsed.source, parsed.output, step, every))


def _check(commands: Any) -> None:
    command = _command(commands, "check", _run_check, "check blend shapes of USD and glTF files")
    command.add_argument("files", type=Path, nargs="+")


def _run_check(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import check

    return _report(parsed, lambda step: check(parsed.files, step), fail_on=("error",))


def _fuzzy(commands: Any) -> None:
    summary = "look into the expression layer"
    group = commands.add_parser("fuzzy", help=summary, description=summary)
    actions = group.add_subparsers(title="actions", required=True, metavar="ACTION")
    command = _command(actions, "explain", _run_explain, "why a frame gets its emotions")
    command.add_argument("shot", type=Path)
    moment = command.add_mutually_exclusive_group()
    moment.add_argument(
        "--frame", type=int, help="frame index (default: where the strongest emotion is strongest)"
    )
    moment.add_argument("--time", type=float, metavar="SECONDS", help="the frame nearest to it")
    command.add_argument("--figure", type=Path, metavar="FILE", help="draw it: .png, .svg or .pdf")
    command = _command(
        actions, "neutral", _run_neutral, "what a neutral face is answered, by paper and shot"
    )
    command.add_argument("shot", type=Path)
    command = _command(actions, "convert", _run_convert, "between .fis, .fcl, .fll and USD")
    command.add_argument("source", type=Path, help="MATLAB .fis, FCL, FLL, or USD with one system")
    _output(command, ".fis, .fcl, .fll, .usda or .usdc")
    _fit(actions)


def _fit(actions: Any) -> None:
    command = _command(
        actions, "fit", _run_fit, "design or learn a system from poses or labelled takes"
    )
    source = command.add_mutually_exclusive_group(required=True)
    source.add_argument("--shot", type=Path, help="whose face, binding and expression poses count")
    source.add_argument("--rig", type=Path, help="USD rig, with --bind")
    command.add_argument("--bind", type=Path, help="where the markers sit on --rig, JSON")
    command.add_argument(
        "--labels",
        type=Path,
        help="CSV or JSON: take, start_s and end_s or start_frame and end_frame, emotion, variant, "
        "intensity (default: the rig's own expression poses)",
    )
    _output(command, ".usda, .usdc, .fis, .fcl or .fll")
    command.add_argument(
        "--expressions", type=Path, metavar="FILE.json", help="also write the expression poses"
    )
    command.add_argument(
        "--figure", type=Path, metavar="FILE", help="draw memberships and confusion"
    )
    default = FitOptions()
    command.add_argument(
        "--paper", action="store_true", help="terms from minimum, medium, maximum over the poses"
    )
    command.add_argument(
        "--space",
        choices=("character", "take"),
        default=default.space,
        help="where features are measured (default: %(default)s)",
    )
    command.add_argument(
        "--hold-out",
        choices=("auto", "recording", "variant"),
        default=default.hold_out,
        help="what is left out in turn to test what was learned (default: %(default)s)",
    )


def _run_fit(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import fit_fuzzy
    from usdface.report import print_fit

    if bool(parsed.rig) != bool(parsed.bind):
        raise InputError("--rig and --bind belong together: give both, or --shot alone")
    if parsed.figure:
        from usdface.picture import check_picture

        check_picture(parsed.figure)
    options = FitOptions(**_settings(parsed, FitOptions))
    fits = []

    def run(step: "OnStep | None") -> "Outcome":
        outcome, fitted = fit_fuzzy(
            parsed.shot or parsed.rig,
            parsed.output,
            options,
            step,
            parsed.bind,
            parsed.labels,
            parsed.expressions,
        )
        if parsed.format == "text":
            print_fit(fitted)
        fits.append(fitted)
        return outcome

    status = _report(parsed, run)
    if parsed.figure:
        from usdface.fit_figure import write_fit_figure

        write_fit_figure(fits[0].system, fits[0].validation, parsed.figure)
    return status


def _run_convert(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import convert_fuzzy

    return _report(parsed, lambda step: convert_fuzzy(parsed.source, parsed.output, step))


def _run_neutral(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import resting
    from usdface.report import print_resting, progress

    with progress(parsed.format == "text") as on_step:
        answers = resting(parsed.shot, on_step)
    print_resting(answers, parsed.format, parsed.report)
    return DONE


def _run_explain(parsed: argparse.Namespace) -> int:
    from usdface.pipeline import explain
    from usdface.report import print_explanation, progress

    if parsed.figure:
        from usdface.picture import check_picture

        check_picture(parsed.figure)
    with progress(parsed.format == "text") as on_step:
        explained = explain(parsed.shot, on_step)
    frame = explained.peak if parsed.frame is None else parsed.frame
    frame = frame if parsed.time is None else explained.frame_at(parsed.time)
    print_explanation(explained.frame(frame), parsed.format, parsed.report)
    if parsed.figure:
        from usdface.figure import write_figure

        write_figure(explained, frame, parsed.figure)
    return DONE


def _bench(commands: Any) -> None:
    summary = "re-compute a published table, or measure the solve on takes of known weights"
    command = _command(commands, "bench", _run_bench, summary)
    command.add_argument("name", choices=("papers", "solve"))
    command.add_argument("--data", type=Path, metavar="DIR", help="of solve: real data")
    command.add_argument("--quick", action="store_true", help="of solve: short takes")


def _run_bench(parsed: argparse.Namespace) -> int:
    if parsed.name == "solve":
        from usdface.bench import print_solve_table, solve_table

        print_solve_table(solve_table(parsed.data, parsed.quick), parsed.format, parsed.report)
        return DONE
    from usdface.papers import tables
    from usdface.report import print_tables

    computed = tables()
    print_tables(computed, parsed.format, parsed.report)
    return DONE if all(table.within for table in computed) else FAILED


def _output(command: argparse.ArgumentParser, what: str) -> None:
    command.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help=what)


def _settings(parsed: argparse.Namespace, kind: Any) -> dict[str, Any]:
    """Return the parsed values that are fields of an options dataclass."""
    return {f.name: getattr(parsed, f.name) for f in fields(kind) if hasattr(parsed, f.name)}


def _check_report(parsed: argparse.Namespace) -> None:
    """Refuse a place for the report where it would take that of another file."""
    from usdface.io.atomic import check_place

    if parsed.report.suffix.lower() != ".json":
        raise OutputError(
            f"cannot write {parsed.report}: the report is JSON; end its name in .json"
        )
    others = [value for name, value in vars(parsed).items() if name != "report"]
    check_place(parsed.report, *(value for value in others if isinstance(value, Path)))


def _report(
    parsed: argparse.Namespace,
    run: "Callable[[OnStep | None], Outcome]",
    fail_on: Sequence[str] = (),
    file: TextIO | None = None,
) -> int:
    """Run a command with progress, print and write what came of it, return the exit status."""
    from usdface.report import print_outcome, progress, write_report

    with progress(parsed.format == "text") as on_step:
        outcome = run(on_step)
    print_outcome(outcome, parsed.format, file)
    if parsed.report:
        write_report(outcome, parsed.report)
    worst = severest(outcome.findings)
    strict = parsed.strict and worst in ("warning", "error")
    return FAILED if strict or worst in fail_on else DONE


if __name__ == "__main__":
    sys.exit(main())
