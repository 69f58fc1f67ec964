from dataclasses import replace

import numpy as np
from worlds import NEUTRAL, make_world

from usdface.binding.propose import propose
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

NO_BINDING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=(0, NEUTRAL - 1))


WORLD = make_world()
STRAYS = tuple(f"*{stray}" for stray in range(10))


def take_with_strays() -> MarkerTake:
    """As a recording has unnamed trajectories, each for some frames at a place of its own."""
    rng = np.random.default_rng(10)
    frames = len(WORLD.take.times)
    size = np.ptp(WORLD.take.positions, axis=(0, 1)).max()
    strays = np.full((frames, len(STRAYS), 3), np.nan)
    for stray in range(len(STRAYS)):
        first = rng.integers(frames - 20)
        strays[first : first + 20, stray] = size * rng.uniform(-4.0, 4.0, 3)
    return replace(
        WORLD.take,
        names=(*WORLD.take.names, *STRAYS),
        positions=np.concatenate([WORLD.take.positions, strays], axis=1),
    )


def test_reflections_far_from_the_face_leave_its_markers_sure() -> None:
    proposal = propose(take_with_strays(), WORLD.rig.meshes[0], NO_BINDING)
    binding = proposal.setup.binding
    places = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    right = sum(places.get(name) == point for name, point in WORLD.points.items())
    assert right > 0.9 * len(WORLD.take.names)
    assert set(proposal.off_face) - set(WORLD.take.names) == set(STRAYS)


def test_a_reflection_with_a_given_vertex_stays_doubted() -> None:
    """Placing the others again without it does not make its vertex a sure one."""
    right = dict(list(WORLD.points.items())[:4])
    given = right | {"*3": WORLD.points["chin"]}
    setup = replace(NO_BINDING, binding=Binding(tuple(given), np.array(list(given.values()))))
    proposal = propose(take_with_strays(), WORLD.rig.meshes[0], setup)
    assert [name for name, _ in proposal.doubted] == ["*3"]
    confidence = proposal.setup.binding.confidence
    assert confidence is not None and confidence[:5].tolist() == [1.0, 1.0, 1.0, 1.0, 0.0]
    assert "*3" not in proposal.off_face  # it is kept at its vertex
