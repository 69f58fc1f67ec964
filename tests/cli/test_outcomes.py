from argparse import SUPPRESS

import pytest
from command_parsers import command_parsers

from usdface.cli.outcomes import OUTCOMES

COMMANDS = command_parsers()


def test_every_command_says_what_it_writes_and_prints() -> None:
    assert set(COMMANDS) == set(OUTCOMES)
    assert all(text.startswith(("Writes", "Prints")) for text in OUTCOMES.values())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_tells_what_each_argument_is(name: str) -> None:
    bare = [
        action.dest
        for action in COMMANDS[name]._actions
        if action.help is not SUPPRESS and not (action.help or "").strip()
    ]
    assert bare == []


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_a_terminal_of_80_columns(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = COMMANDS[name].format_help().partition("\nexamples:")[0]
    assert max(map(len, text.splitlines())) <= 80
