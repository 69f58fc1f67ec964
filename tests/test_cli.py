import json
import os
import subprocess
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest
from worlds import World, make_world

from usdface import __version__
from usdface.cli import main
from usdface.io.bind_file import setup_of_json

COMMANDS = ("rig", "take", "shot", "process", "export", "import", "check", "bench")


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture
def folder(world: World, tmp_path: Path) -> Path:
    return world.write(tmp_path)


def shot_command(folder: Path, *options: str) -> list[str]:
    files = [f"--{n}={folder / n}.usda" for n in ("rig", "take")]
    return ["shot", *files, f"--bind={folder}/bind.json", "-o", f"{folder}/shot.usda", *options]


@pytest.mark.slow
def test_the_whole_way_says_what_it_wrote(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(shot_command(folder)) == 0
    assert f"wrote {folder / 'shot.usda'}" in capfd.readouterr().out
    assert main(["process", str(folder / "shot.usda"), "--gltf", str(folder / "a.glb")]) == 0
    printed = capfd.readouterr()
    for name in ("shot.usdface.usda", "shot.usdface/solve.usdc", "shot.usdface/express.usdc"):
        assert f"wrote {folder / name}" in printed.out
    assert "a.glb" in printed.out and "emotion peaks" in printed.out
    assert printed.err == ""
    result = str(folder / "shot.usdface.usda")
    assert main(["check", result, str(folder / "a.glb")]) == 0
    assert main(["export", result, "-o", str(folder / "b.glb")]) == 0
    assert main(["export", result, "-o", str(folder / "b.usdz")]) == 0
    assert main(["import", str(folder / "b.glb"), "-o", str(folder / "c.usdc")]) == 0
    assert main(["rig", str(folder / "b.glb"), "-o", str(folder / "d.usda")]) == 0
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_json_is_all_that_standard_output_holds(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    result, glb = str(folder / "shot.usdface.usda"), str(folder / "a.glb")
    for command in (
        ["rig", str(folder / "rig.usda"), "-o", str(folder / "rig_2.usdc")],
        shot_command(folder),
        ["process", str(folder / "shot.usda")],
        ["export", result, "-o", glb],
        ["import", glb, "-o", str(folder / "back.usda")],
        ["check", result, glb],
    ):
        assert main([*command, "--format", "json"]) == 0
        printed = capfd.readouterr()
        document = json.loads(printed.out)
        plain = {"written", "findings", "summary", "seconds", "peak_memory_mb"}
        more = {"process": {"residual", "confidence", "travel", "travel_by_part", "verdict"}}
        more |= {"export": {"certificate"}, "import": {"certificate"}}
        assert set(document) == plain | more.get(command[0], set())
        assert all(Path(path).is_file() for path in document["written"])
        assert printed.err == ""


def test_the_report_file_holds_the_same(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    report = folder / "reports" / "shot.json"
    assert main(shot_command(folder, "--format", "json", "--report", str(report))) == 0
    printed, written = json.loads(capfd.readouterr().out), json.loads(report.read_text())
    for same in ("written", "findings", "summary", "seconds"):
        assert printed[same] == written[same]


@pytest.mark.parametrize("form", ["text", "json"])
def test_the_printed_binding_is_a_binding(
    folder: Path, world: World, capfd: pytest.CaptureFixture[str], form: str
) -> None:
    assert main(shot_command(folder, "--print-bind", "--format", form)) == 0
    printed = capfd.readouterr()
    setup = setup_of_json(json.loads(printed.out), "printed")
    assert setup.binding.markers == tuple(world.points) and setup.nose_tip == "nose"
    assert setup.binding.mesh == "/Asset/Face/head"
    assert "shot.usda" in printed.err


def test_strict_makes_warnings_fail(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    # The small face has no shapes for anger: a warning.
    assert main(shot_command(folder)) == 0
    assert "warning EXPRESSION_UNKNOWN" in capfd.readouterr().out
    assert main(shot_command(folder, "--strict")) == 1
    reason = (
        "usdface: failed, as --strict counts warnings as errors: SHAPE_UNKNOWN, EXPRESSION_UNKNOWN"
    )
    assert capfd.readouterr().err.splitlines()[-1].startswith(reason)
    # Nothing to warn about.
    shot = str(folder / "shot.usda")
    assert main(["process", shot, "--no-express", "--strict"]) == 0
    assert "--strict" not in capfd.readouterr().err


def test_check_fails_on_errors_without_strict(folder: Path) -> None:
    rig = folder / "rig.usda"
    assert main(["check", str(rig)]) == 0
    text = rig.read_text().replace(
        "uniform int[] pointIndices = [", "uniform int[] pointIndices = [9999, "
    )
    rig.write_text(text)
    assert main(["check", str(rig)]) == 1


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["sing"],
        ["rig"],
        ["rig", "a.glb"],
        ["rig", "a.glb", "-o", "b.usda", "--up-axis", "X"],
        ["take", "a.c3d", "-o", "b.usda", "--units", "furlong"],
        ["take", "a.c3d", "-o", "b.usda", "--rate", "fast"],
        ["take", "a.csv", "-o", "b.usda", "--image-size", "100"],
        ["shot", "--rig", "a.usda", "-o", "b.usda"],
        ["process"],
        ["process", "a.usda", "--in-place", "-o", "b.usda"],
        ["process", "a.usda", "--format", "xml"],
        ["check"],
        ["bench", "mine"],
    ],
)
def test_wrong_usage_exits_with_2(arguments: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    printed = capfd.readouterr()
    assert printed.out == "" and printed.err.startswith("usage: usdface")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    printed = capsys.readouterr().out
    assert f"usage: usdface {command}" in printed and "--report FILE" in printed


def test_help_and_version_load_nothing_heavy() -> None:
    script = (
        "import sys\nfrom usdface.cli import main\n"
        "for option in ('--help', '--version'):\n"
        "    try: main([option])\n"
        "    except SystemExit as done: assert done.code == 0\n"
        "heavy = {'numpy', 'pxr', 'scipy', 'rich', 'trimesh', 'pygltflib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert __version__ in done.stdout
    assert all(command in done.stdout for command in COMMANDS)


def test_bench_papers_keeps_what_it_promises(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "papers", "--format", "json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["tables"]) == 2


def test_a_closed_standard_error_says_nothing_on_standard_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As some queues start their jobs (2>&-): `sys.stderr` is None then."""
    monkeypatch.setattr("sys.stderr", None)
    assert main(["process", str(tmp_path / "none.usda"), "--format", "json"]) == 1
    assert json.loads(capsys.readouterr().out)["error"]["code"]


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (PermissionError(13, "Permission denied", "locked/a.usda"), "FILE_UNREADABLE"),
        (MemoryError(), "TOO_LARGE"),
        (ValueError("no such thing"), "PROGRAM_FAULT"),
    ],
)
def test_every_error_is_json_with_a_code(
    fault: Exception,
    code: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def check(*given: object, **named: object) -> None:
        raise fault

    monkeypatch.setattr("usdface.cli.convert.pipeline.check", check)
    assert main(["check", "a.usda", "--format", "json"]) == 1
    printed = capsys.readouterr()
    error = json.loads(printed.out)["error"]
    assert error["code"] == code and f"usdface: {error['message']}\n" == printed.err


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_json_is_utf_8_wherever_it_goes(
    encoding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "grün 😀.usda").write_text("#usda 1.0\n")
    printed = BytesIO()
    monkeypatch.setattr("sys.stdout", TextIOWrapper(printed, encoding=encoding))
    assert main(["check", str(tmp_path / "grün 😀.usda"), "--format", "json"]) == 0
    assert "check grün 😀.usda" in json.loads(printed.getvalue().decode("utf-8"))["seconds"]


FULL = "usdface: standard output: No space left on device\n"


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    ("command", "sink", "said"),
    [
        ("plugins", "pipe", ""),
        ("plugins", "/dev/full", FULL),
        ("check missing.usda", "/dev/full", "usdface: no such file: missing.usda"),
    ],
)
def test_an_output_that_takes_no_more_is_one_line_at_most(
    command: str, sink: str, said: str, unbuffered: str
) -> None:
    """Of a pipe whose reader left (`usdface ... | head`) nothing is said."""
    done = run_into(sink, "stdout", [*command.split(), "--format", "json"], unbuffered)
    assert done.returncode == 1 and done.stderr.partition(" [")[0] == said
    assert done.stderr.count("\n") <= 1


@pytest.mark.parametrize("sink", ["pipe", "/dev/full"])
def test_a_standard_error_that_takes_no_more_leaves_the_exit_status(sink: str) -> None:
    """The interpreter would end with 120."""
    done = run_into(sink, "stderr", ["check", "missing.usda", "--format", "json"])
    assert done.returncode == 1 and json.loads(done.stdout)["error"]["code"] == "FILE_UNREADABLE"
    assert run_into(sink, "stderr", ["frobnicate"]).returncode == 2


def run_into(
    sink: str, stream: str, arguments: list[str], unbuffered: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run the command line with a stream that takes nothing."""
    if sink == "pipe":
        reader, writer = os.pipe()
        os.close(reader)
    elif not Path(sink).exists():
        pytest.skip("this system has no /dev/full")
    else:
        writer = os.open(sink, os.O_WRONLY)
    done = subprocess.run(
        [sys.executable, "-m", "usdface", *arguments],
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: writer},  # type: ignore[call-overload]
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
    )
    os.close(writer)
    return done


@pytest.mark.parametrize(
    ("wrong", "hint"),
    [("--exagerate", "; did you mean --exaggeration?"), ("--no-closures=1", "--no-closure?")],
)
def test_a_misspelt_option_is_named_with_the_one_that_was_meant(
    wrong: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["process", "shot.usda", wrong, "2"])
    said = capsys.readouterr().err
    assert caught.value.code == 2 and said.startswith("usage: usdface process")
    assert f"unrecognized arguments: {wrong} 2" in said and said.endswith(f"{hint}\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        # Not "required: --rig", which was meant.
        ("shot --rigg a --take b -o c", "unrecognized arguments: --rigg; did you mean --rig?"),
        ("fuzzy fit --shto a -o b", "unrecognized arguments: --shto; did you mean --shot?"),
        ("shot --rig a", "the following arguments are required: --take, -o/--output"),
        ("proces a", "there is no command 'proces'; did you mean process?"),
        ("sing", "there is no command 'sing'; `usdface --help` lists all"),
    ],
)
def test_a_misspelt_word_is_named_rather_than_what_it_leaves_open(
    words: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words.split())
    assert caught.value.code == 2 and capsys.readouterr().err.endswith(f"error: {said}\n")
