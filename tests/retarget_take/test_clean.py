"""The clean-up of a bound take: which labels of a swap that never ends are right."""

from dataclasses import replace

import pytest
from worlds import World, make_world

from usdface.retarget_take.clean import clean, clean_inputs

SWAPPED, SINCE = ["cheek_l", "corner_l"], 12


@pytest.fixture(scope="module")
def world() -> World:
    """Two labels are exchanged from frame 12 of 40 to the end."""
    world = make_world()
    take, positions = world.take, world.take.positions.copy()
    pair = [take.names.index(name) for name in SWAPPED]
    positions[SINCE:, pair] = positions[SINCE:, pair[::-1]]
    return replace(world, take=replace(take, positions=positions))


def swaps(world: World, **changes: object) -> dict[str, tuple[int, int]]:
    cleaned, _ = clean(world.take, world.setup(**changes))
    return {r.marker: (r.first, r.last) for r in cleaned.repairs if r.kind == "swap"}


def test_the_labels_of_named_neutral_frames_are_right(world: World) -> None:
    last = len(world.take.times) - 1
    assert swaps(world, neutral=(0, 3)) == dict.fromkeys(SWAPPED, (SINCE, last))
    assert swaps(world, neutral=(30, 33)) == dict.fromkeys(SWAPPED, (0, SINCE - 1))


def test_without_named_ones_those_of_most_frames_are(world: World) -> None:
    assumed = swaps(world, neutral=(0, 0), neutral_assumed=True)
    assert assumed == swaps(world, neutral=None) == dict.fromkeys(SWAPPED, (0, SINCE - 1))


def test_neutral_frames_that_the_take_lacks_are_left_to_the_solve(world: World) -> None:
    for neutral in ((0, 4000), (9, 3)):
        assert swaps(world, neutral=neutral) == swaps(world, neutral=None)


def test_the_clean_up_depends_on_neutral_frames_that_are_named(world: World) -> None:
    def key(**changes: object) -> object:
        return clean_inputs(world.take, world.setup(**changes))[1:]

    assert key(neutral=(0, 3)) != key(neutral=(0, 4))
    assert key(neutral=(0, 3), neutral_assumed=True) == key(neutral=None)
