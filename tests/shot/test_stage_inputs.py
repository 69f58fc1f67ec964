"""All that a stage of a retarget depends on is in its inputs, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, make_world

from usdface.content_digest import content_digest
from usdface.options import ClosureOptions
from usdface.rigs import Skeleton
from usdface.shot.assembly import assemble_shot
from usdface.shot.shot import Shot
from usdface.shot.stage_inputs import express_inputs, solve_inputs


@pytest.fixture(scope="module")
def shot() -> Shot:
    world = make_world()
    setup = world.setup(neutral=(0, NEUTRAL - 1), nose_tip="nose")
    return assemble_shot(world.rig, world.take, setup=setup)[0]


def test_a_joint_that_moves_is_an_input_of_the_correction(shot: Shot) -> None:
    """A recorded head turns about it; a cache that did not know kept the head where it was."""
    place = np.eye(4)[None]
    lower = place.copy()
    lower[0, 3, 1] = -0.05
    rigs = [
        replace(shot.rig, skeleton=Skeleton(("head",), ("head",), bind, bind))
        for bind in (place, lower)
    ]
    one, same, other = (
        content_digest(express_inputs(replace(shot, rig=rig))) for rig in (rigs[0], *rigs)
    )
    assert one == same != other


def test_closures_are_an_input_of_the_correction_alone(shot: Shot) -> None:
    open_lids = replace(shot, setup=replace(shot.setup, closure=ClosureOptions(lids=False)))
    pair = (shot, open_lids)
    solve, same = (content_digest(solve_inputs(one)) for one in pair)
    express, other = (content_digest(express_inputs(one)) for one in pair)
    assert solve == same and express != other
