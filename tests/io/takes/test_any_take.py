from pathlib import Path

import pytest
from worlds import make_world

from usdface.errors import InputError
from usdface.io.takes.any_take import read_any_take


def test_a_take_in_usd_and_one_of_a_recording_are_read(tmp_path: Path) -> None:
    world = make_world()
    world.write(tmp_path)
    take, _ = read_any_take(tmp_path / "take.usda")
    assert take.names == world.take.names
    (tmp_path / "take.csv").write_text("time,chin_x,chin_y,chin_z\n0,1,2,3\n0.1,1,2,3\n")
    recorded, findings = read_any_take(tmp_path / "take.csv")
    assert recorded.names == ("chin",)
    assert "UNITS_ASSUMED" in {f.code for f in findings}


@pytest.mark.parametrize("name", ["none.usda", "none.trc", "none.mov"])
def test_what_is_no_take_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        read_any_take(tmp_path / name)
