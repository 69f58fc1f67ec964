"""Every command, every output, every file that it reads: refused, whatever the name is."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_parsers import command_parsers
from composed import GLTF, RIG, SHOT, compose
from spoilt import Place, Refused

from usdface.cli import main
from usdface.pipeline import process

BIND, LABELS = ["bind.json"], ["labels.csv", "take.usda"]
HEADS = ["heads/neutral.obj", "heads/smile.obj", "heads/combinations.json"]
HUMAN = ["human/base.obj", "human/targets/smile.target"]
USD, FUZZY, SHOWN, SAID = (".usda",), (".fis", ".usda"), (".png",), (".json",)
PAGE = (".html",)


@dataclass(frozen=True)
class Case:
    """A command with its inputs, the files that it reads by them, and its outputs' suffixes."""

    command: tuple[str, ...]
    reads: list[str]
    outputs: dict[str, tuple[str, ...]]


def case(command: str, reads: list[str], **outputs: tuple[str, ...]) -> Case:
    return Case(tuple(command.split()), reads, outputs | {"report": SAID})


CASES = [
    case("rig lay/rig.usda", RIG, output=USD),
    case("rig face.gltf", GLTF, output=USD),
    case("rig heads", HEADS, output=USD),
    case("rig human", HUMAN, output=USD),
    case("take take.csv", ["take.csv"], output=USD),
    case(
        "take take.csv take.usda --cameras who.json",
        ["take.csv", "take.usda", "who.json"],
        output=USD,
    ),
    case(
        "take face_textures/0.png --names labels.csv --fix who.json",
        ["face_textures/0.png", "labels.csv", "who.json"],
        output=USD,
        sheet=SHOWN,
    ),
    case(
        "take face_textures/0.png --bind bind.json --rig lay/rig.usda",
        ["face_textures/0.png", *RIG, *BIND],
        output=USD,
        sheet=SHOWN,
    ),
    case("markers lay/rig.usda --bind bind.json", RIG + BIND, output=SAID, figure=SHOWN),
    case(
        "shot --rig lay/rig.usda --take take.usda --bind bind.json --fuzzy system.fis "
        "--expressions poses.json --calibration who.json --performer-layer who.usda "
        "--character-layer head.usda",
        ["take.usda", "system.fis", "poses.json", "who.json", *RIG, *BIND],
        output=USD,
        write_bind=SAID,
        bind_figure=SHOWN,
    ),
    case("calibrate shot.usda", SHOT, output=SAID),
    case(
        "process shot.usda",
        SHOT,
        output=USD,
        gltf=(".glb", ".bin"),
        figure=SHOWN,
        sheet=SHOWN,
        deliver=USD,
    ),
    case("sequence shot.usda", SHOT, table=PAGE),
    case(
        "conform cut.edl take.usda --show who.json",
        ["cut.edl", "take.usda", "who.json"],
        output=SAID,
    ),
    case("plugins", []),
    case("process shot.usda --in-place", SHOT, gltf=(".glb",), figure=SHOWN, sheet=SHOWN),
    case("view shot.usda", SHOT, output=PAGE),
    case(
        "view shot.usda --footage face_textures/0.png --tracks who.json",
        ["who.json", "face_textures/0.png"],
        output=PAGE,
    ),
    case("view face.gltf", GLTF, output=PAGE),
    case("bind shot.usda", SHOT, output=PAGE),
    case(
        "bind lay/rig.usda --take take.usda --bind bind.json",
        ["take.usda", *RIG, *BIND],
        output=PAGE,
    ),
    case("export shot.usda", SHOT, output=(".glb", ".bin", ".usdz")),
    case("import face.gltf --rig lay/rig.usda", GLTF + RIG, output=USD),
    case("check lay/rig.usda face.gltf", RIG + GLTF),
    case("check lay/rig.usda --facs", RIG, figure=SHOWN),
    case("formats", []),
    case("fuzzy explain shot.usda", SHOT, figure=SHOWN),
    case("fuzzy neutral shot.usda", SHOT),
    case("fuzzy convert system.fis", ["system.fis"], output=FUZZY),
    case("fuzzy convert shot.usda", SHOT, output=FUZZY),
    case("fuzzy paper", [], output=FUZZY),
    case("fuzzy fit --shot shot.usda", SHOT, output=FUZZY, expressions=SAID, figure=SHOWN),
    case(
        "fuzzy fit --rig lay/rig.usda --bind bind.json --labels labels.csv",
        RIG + BIND + LABELS,
        output=FUZZY,
        expressions=SAID,
        figure=SHOWN,
    ),
    case("bench solve --data heads", HEADS),
    case(
        "bench papers --images face_textures/0.png --rig lay/rig.usda --bind bind.json "
        "--reference take.usda --names labels.csv",
        ["face_textures/0.png", "take.usda", "labels.csv", *RIG, *BIND],
    ),
]


def outputs() -> Iterator:
    """Each output with some of the files that are read, so that all are tried with each command."""
    for case in CASES:
        kinds = [(option, suffix) for option, of in case.outputs.items() for suffix in of]
        for number, (option, suffix) in enumerate(kinds):
            tried = case.reads[number :: len(kinds)] or case.reads[-1:]
            if tried:
                name = f"{'_'.join(case.command[:3])} {option}{suffix}"
                yield pytest.param(case, option, suffix, tried, id=name)


@pytest.fixture
def around(place: Place) -> Place:
    """The place with all that can be composed; the shot stands on lay/rig.usda."""
    compose(place.folder)
    place.replace("shot.usda", "rig.usda", "lay/rig.usda")
    return place


@pytest.mark.slow
@pytest.mark.parametrize(("case", "option", "suffix", "tried"), list(outputs()))
def test_no_output_takes_the_place_of_a_file_that_is_read(
    around: Place,
    refused: Refused,
    monkeypatch: pytest.MonkeyPatch,
    case: Case,
    option: str,
    suffix: str,
    tried: list[str],
) -> None:
    """A file that is read, under another name that suits the output."""
    monkeypatch.chdir(around.folder)
    command = [*case.command]
    if "output" in case.outputs and option != "output":
        command += ["-o", f"new{case.outputs['output'][0]}"]
    named = "face2.gltf" if suffix == ".bin" else f"face2{suffix}"
    command += [f"--{option.replace('_', '-')}", named]
    other = around / f"face2{suffix}"
    for number, name in enumerate(tried):
        (os.link if number % 2 else os.symlink)(around / name, other)
        message = refused(command)
        # That it is no report shows before the shots of a sequence are found.
        early = case.command[0] == "sequence" and option == "report" and "another origin" in message
        assert other.name in message and ("overwritten" in message or early), name
        other.unlink()


def test_the_table_has_every_command_and_every_option_that_names_a_file() -> None:
    """A new option is an input or an output: the table says which, and the parser agrees."""
    outputs: dict[str, set[str]] = {}
    inputs: dict[str, set[str]] = {}
    for case in CASES:
        name = " ".join(case.command[: 2 if case.command[0] == "fuzzy" else 1])
        outputs.setdefault(name, set()).update(case.outputs)
        given = {word[2:].replace("-", "_") for word in case.command if word.startswith("--")}
        inputs.setdefault(name, set()).update(given)
    for name, command in command_parsers().items():
        files = {
            (action.option_strings or [action.dest])[-1].lstrip("-").replace("-", "_")
            for action in command._actions
            if action.type is Path or "FILE" in str(action.metavar) or action.metavar == "ROOT"
        }
        written = {*command.get_default("writes"), "report"} & {
            action.dest for action in command._actions
        }
        assert written == outputs[name], name
        placed = {a.dest for a in command._actions if not a.option_strings}
        assert files - written - placed <= inputs[name], name


def test_two_outputs_are_two_files(around: Place, refused: Refused) -> None:
    place = around
    (place / "old.json").write_text("{}")
    os.link(place / "old.json", place / "other.json")
    fit = ["fuzzy", "fit", "--shot", place / "shot.usda", "-o", place / "new.fis"]
    for one, other in (
        ("a.json", "a.json"),
        ("a.json", "lay/../a.json"),
        ("old.json", "other.json"),
    ):
        both = [*fit, "--expressions", place / one, "--report", place / other]
        assert "is the same file as the output" in refused(both)
        both = ["calibrate", place / "shot.usda", "-o", place / one, "--report", place / other]
        assert "is the same file as the output" in refused(both)


@pytest.mark.slow
def test_a_result_that_another_layer_reads_is_an_input(place: Place, refused: Refused) -> None:
    """Processed in place, a shot may be processed again; what others made of it stays."""
    assert main(["process", str(place / "shot.usda"), "--in-place"]) == 0
    first = (place / "shot.usdface/solve.usdc").read_bytes()
    process(place / "shot.usda")
    assert (place / "shot.usdface/solve.usdc").read_bytes() == first
    (place / "more.usda").write_text("#usda 1.0\n(subLayers = [@shot.usdface/solve.usdc@])\n")
    place.edit("shot.usda", lambda stage: stage.GetRootLayer().subLayerPaths.append("more.usda"))
    message = refused(place.process)
    assert "solve.usdc is read by" in message and "overwritten" in message


@pytest.mark.slow
def test_results_are_written_again(place: Place) -> None:
    """Only what is read is kept: the second run replaces what the first has written."""
    command = [*place.process, "--gltf", place / "face.gltf", "--report", place / "r.json"]
    for _ in range(2):
        assert main([str(word) for word in command]) == 0
