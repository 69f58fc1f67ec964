from dataclasses import replace

import numpy as np
from worlds import NEUTRAL, make_world

from usdface.binding.propose import propose
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

NO_BINDING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=(0, NEUTRAL - 1))


def test_reflections_far_from_the_face_leave_its_markers_sure() -> None:
    """As a recording has unnamed trajectories, each for some frames at a place of its own."""
    world = make_world()
    count, rng = 10, np.random.default_rng(10)
    frames, markers = world.take.positions.shape[:2]
    size = np.ptp(world.take.positions, axis=(0, 1)).max()
    strays = np.full((frames, count, 3), np.nan)
    for stray in range(count):
        first = rng.integers(frames - 20)
        strays[first : first + 20, stray] = size * rng.uniform(-4.0, 4.0, 3)
    take = replace(
        world.take,
        names=(*world.take.names, *(f"*{stray}" for stray in range(count))),
        positions=np.concatenate([world.take.positions, strays], axis=1),
    )
    proposal = propose(take, world.rig.meshes[0], NO_BINDING)
    binding = proposal.setup.binding
    places = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    right = sum(places.get(name) == point for name, point in world.points.items())
    assert right > 0.9 * markers
    assert set(proposal.off_face) - set(world.take.names) == set(take.names[markers:])
