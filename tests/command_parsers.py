"""The parser of each command, for tests that look at all of them."""

from argparse import ArgumentParser, _SubParsersAction
from collections.abc import Iterator

from usdface.cli import _parser


def command_parsers() -> dict[str, ArgumentParser]:
    """The commands that run something, by name: "rig", "fuzzy fit"."""
    return dict(_below(_parser()))


def _below(parser: ArgumentParser, name: str = "") -> Iterator[tuple[str, ArgumentParser]]:
    groups = [action for action in parser._actions if isinstance(action, _SubParsersAction)]
    if not groups:
        yield name, parser
    for word, command in (pair for group in groups for pair in group.choices.items()):
        yield from _below(command, f"{name} {word}".strip())
