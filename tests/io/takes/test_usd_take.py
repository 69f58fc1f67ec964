from pathlib import Path

import pytest
from worlds import make_world

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions


def test_a_take_in_usd_is_read(tmp_path: Path) -> None:
    world = make_world()
    world.write(tmp_path)
    take, _ = read_take(tmp_path / "take.usda")
    assert take.names == world.take.names


def test_it_names_its_own_units(tmp_path: Path) -> None:
    make_world().write(tmp_path)
    with pytest.raises(InputError, match="USD has no use for units = 'mm'"):
        read_take(tmp_path / "take.usda", TakeOptions(units="mm"))


@pytest.mark.parametrize("name", ["none.usda", "rig.usda", "none.mov"])
def test_what_is_no_take_is_refused(tmp_path: Path, name: str) -> None:
    make_world().write(tmp_path)
    with pytest.raises(InputError):
        read_take(tmp_path / name)
