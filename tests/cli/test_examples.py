import shlex

import pytest
from command_parsers import command_parsers

from usdface.cli import _parser
from usdface.cli.examples import EXAMPLES


def test_every_command_has_examples() -> None:
    assert set(command_parsers()) == set(EXAMPLES)


@pytest.mark.parametrize("line", [line for both in EXAMPLES.values() for line in both])
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
