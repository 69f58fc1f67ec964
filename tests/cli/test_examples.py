import shlex

import pytest
from command_parsers import command_parsers

from usdface.cli import _parser
from usdface.cli.examples import EXAMPLES, MAIN_JOB


def test_every_command_has_examples() -> None:
    assert set(command_parsers()) == set(EXAMPLES)


@pytest.mark.parametrize(
    "line", [*MAIN_JOB, *(line for both in EXAMPLES.values() for line in both)]
)
def test_an_example_is_one_of_its_command_and_can_be_parsed(line: str) -> None:
    program, *words = shlex.split(line)
    assert program == "usdface"
    _parser().parse_args(words)


@pytest.mark.parametrize("command", EXAMPLES)
def test_help_ends_with_them(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        _parser().parse_args([*command.split(), "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out.rstrip().splitlines()[-3:]
    assert shown == ["examples:", *(f"  {line}" for line in EXAMPLES[command])]


def test_the_help_of_the_program_has_the_main_job_line_by_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        _parser().parse_args(["--help"])
    shown = capsys.readouterr().out
    assert "\n".join(("the main job:", *(f"  {line}" for line in MAIN_JOB))) in shown
