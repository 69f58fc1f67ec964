from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import make_world

from usdface.errors import InputError
from usdface.figures.binding import write_bind_figure
from usdface.setup.binding import Binding

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
BINDING = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))


@pytest.mark.slow
@pytest.mark.parametrize(
    "suffix", [".png", *(pytest.param(name, marks=pytest.mark.slow) for name in (".svg", ".pdf"))]
)
def test_the_figure_is_the_same_twice(tmp_path: Path, suffix: str) -> None:
    one, two = (tmp_path / f"{name}{suffix}" for name in ("one", "two"))
    for path in (one, two):
        write_bind_figure(MESH, BINDING, path)
    assert one.read_bytes() == two.read_bytes()
    if suffix == ".png":
        assert one.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert np.frombuffer(one.read_bytes()[16:24], ">u4").min() > 500
    if suffix == ".svg":
        assert all(f"<!-- {name} -->" in one.read_text() for name in BINDING.markers)


@pytest.mark.slow
def test_what_is_not_sure_looks_different_and_has_a_scale(tmp_path: Path) -> None:
    doubtful = replace(BINDING, confidence=np.linspace(0, 1, len(BINDING.markers)))
    sure = replace(BINDING, confidence=np.ones(len(BINDING.markers)))
    drawn = []
    for binding in (BINDING, sure, doubtful):
        write_bind_figure(MESH, binding, tmp_path / "face.svg")
        drawn.append((tmp_path / "face.svg").read_text())
    assert drawn[1] != drawn[2]
    assert ["<!-- confidence -->" in svg for svg in drawn] == [False, True, True]


def test_another_file_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no picture"):
        write_bind_figure(MESH, BINDING, tmp_path / "face.txt")
