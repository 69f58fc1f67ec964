from dataclasses import dataclass, field

import numpy as np
from worlds import make_world

import usdface
from usdface.short_repr import short_repr


@dataclass(frozen=True)
class Inner:
    values: tuple[int, ...] = (1, 2)


@dataclass(frozen=True)
class Outer:
    name: str
    places: object = None
    many: tuple[int, ...] = ()
    inner: Inner = field(default_factory=Inner)
    rate: float = 0.0

    __repr__ = short_repr


def test_arrays_are_shown_by_their_shape_and_defaults_are_left_out() -> None:
    assert repr(Outer("a")) == "Outer(name='a')"
    assert repr(Outer("a", np.ones((2, 3)), rate=24.0)) == (
        "Outer(name='a', places=<2 x 3 float64>, rate=24.0)"
    )
    assert repr(Outer("a", many=tuple(range(9)), inner=Inner((3,)))) == (
        "Outer(name='a', many=(0, 1, 2, 3, ...), inner=Inner(...))"
    )
    assert repr(Outer("a", np.float64(3.0))).startswith("Outer(name='a', places=")


def test_a_whole_shot_is_a_line() -> None:
    world = make_world()
    shot, _ = usdface.assemble_shot(world.rig, world.take, setup=world.setup())
    mesh = world.rig.meshes[0]
    for value in (world.rig, mesh, mesh.shapes[0], world.take, shot.setup, shot):
        assert len(repr(value)) < 1000 and "\n" not in repr(value)
    result = usdface.Result(
        usdface.retarget(shot), details={"frames": [{"weights": list(range(99))}] * 99}
    )
    assert len(repr(result)) < 200 and len(repr(result.value)) < 1500
    assert "positions=<40 x 23 x 3 float64>, rate=30.0" in repr(world.take)
