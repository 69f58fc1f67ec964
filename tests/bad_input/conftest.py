"""Bad input: one line that says what and where, exit status 1, and nothing changed."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from spoilt import Place, listing
from worlds import World, make_world

from usdface.cli import main


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[World, dict[str, bytes]]:
    """The world's files, made once."""
    world = make_world()
    place = Place(world.write(tmp_path_factory.mktemp("made")), world)
    command = [str(a) for a in place.shot[:-1]] + [str(place / "shot.usda")]
    assert main(command) == 0
    return world, {p.name: p.read_bytes() for p in place.folder.iterdir()}


@pytest.fixture
def place(made: tuple[World, dict[str, bytes]], tmp_path: Path) -> Place:
    world, files = made
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    return Place(tmp_path, world)


@pytest.fixture
def refused(
    place: Place, capfd: pytest.CaptureFixture[str]
) -> Iterator[Callable[[Sequence[object]], str]]:
    """A function that runs a command, checks how it is refused, and returns what it said."""

    def run(arguments: Sequence[object]) -> str:
        before = listing(place.folder)
        capfd.readouterr()
        status = main([str(a) for a in arguments])
        printed = capfd.readouterr()
        assert status == 1
        assert printed.out == ""
        assert re.fullmatch(r"usdface: [^\n]+\n", printed.err), printed.err
        assert "a mistake in usdface" not in printed.err
        assert listing(place.folder) == before
        return printed.err.strip()

    yield run
