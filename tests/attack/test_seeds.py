"""Every take format is attacked: a good file of it is among the seeds."""

from pathlib import Path

from attack.seeds import make_seeds

from usdface.io.takes.formats import TAKE_READERS

# Folders and films, whose files have readers of their own; a second name of one with a seed.
APART = {"folder of Blender's tracks", "images of painted dots", "TRC as CSV"}


def test_every_take_format_has_a_seed(tmp_path: Path) -> None:
    place = tmp_path / "seeds"
    place.mkdir()
    read = set()
    for seed in make_seeds(place):
        words = seed.commands[0] if seed.commands else ()
        if words[:2] == ("take", "FILE"):
            read.add(TAKE_READERS.find(seed.file)[0].format.name)
    known = {reader.name for reader in TAKE_READERS.built_in}
    assert known - read == APART, "write a good file of it in tests/attack/seeds.py"
