from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

import usdface
from usdface.errors import InputError
from usdface.options import PIN_REACH
from usdface.retarget.pins import check_pins, faded_at_pins, pin_bounds, with_pins
from usdface.setup.pin import Pin
from usdface.takes import WeightsTake

TIMES = np.arange(120) / 60
NAMES = ("jaw", "smile", "brow")
FREE = 0.5 + 0.4 * np.sin(np.outer(TIMES, [1.0, 2.0, 3.0]))
PINS = (Pin("jaw", np.array([40, 46, 100]), np.array([0.0, 0.2, 1.0])), Pin("gone", [3], [1.0]))


def test_pins_are_met_and_only_their_neighbours_bend() -> None:
    bent = with_pins(PINS, NAMES, TIMES, FREE)
    np.testing.assert_array_equal(bent[[40, 46, 100], 0], [0.0, 0.2, 1.0])
    np.testing.assert_array_equal(bent[:, 1:], FREE[:, 1:])
    apart = np.abs(TIMES[:, None] - TIMES[[40, 46, 100]]).min(axis=1)
    far = apart >= PIN_REACH
    np.testing.assert_array_equal(bent[far, 0], FREE[far, 0])
    assert (np.abs(bent - FREE)[~far, 0] > 0).mean() > 0.9
    assert bent.min() >= 0 and bent.max() <= 1


def test_the_way_to_a_pin_is_smooth() -> None:
    alone = (Pin("smile", np.array([60]), np.array([0.0])),)
    free = np.full_like(FREE, 0.8)
    curve = with_pins(alone, NAMES, TIMES, free)[:, 1]
    assert curve[60] == 0.0
    # A frame of its own would jump by 0.8; a smooth step of 12 frames rises by 0.1 at most.
    assert np.abs(np.diff(curve)).max() < 0.11
    assert (np.diff(curve[60:73]) >= 0).all() and (np.diff(curve[47:61]) <= 0).all()


def test_bounds_leave_free_what_is_out_of_reach() -> None:
    bounds = pin_bounds(PINS, NAMES, TIMES, FREE, np.zeros((0, 3)))
    lower, upper = bounds.over(*FREE.shape)
    held = lower == upper
    assert held[[40, 46, 100], 0].all() and not held[:, 1:].any()
    np.testing.assert_array_equal(lower[held], with_pins(PINS, NAMES, TIMES, FREE)[held])
    assert (lower[~held] == 0).all() and (upper[~held] == 1).all()


def test_a_correction_fades_out_towards_pins() -> None:
    corrected = np.minimum(FREE + 0.3, 1.0)
    kept = faded_at_pins(PINS, NAMES, TIMES, FREE, corrected)
    np.testing.assert_array_equal(kept[[40, 46, 100], 0], FREE[[40, 46, 100], 0])
    np.testing.assert_array_equal(kept[:, 1:], corrected[:, 1:])
    change = kept[:, 0] - FREE[:, 0]
    assert (change >= 0).all() and (change <= corrected[:, 0] - FREE[:, 0] + 1e-15).all()


@pytest.mark.parametrize("pins", [(), (Pin("gone", np.array([3]), np.array([1.0])),)])
def test_without_pins_nothing_changes(pins: tuple[Pin, ...]) -> None:
    np.testing.assert_array_equal(with_pins(pins, NAMES, TIMES, FREE), FREE)
    np.testing.assert_array_equal(faded_at_pins(pins, NAMES, TIMES, FREE, FREE + 0.1), FREE + 0.1)


def test_pins_of_no_blend_shape_and_beyond_the_take_are_refused() -> None:
    check_pins(PINS[:1], NAMES, 101)
    with pytest.raises(InputError, match="'gone'"):
        check_pins(PINS, NAMES, 101)
    with pytest.raises(InputError, match="frame 100; the take has 100 frames"):
        check_pins(PINS[:1], NAMES, 100)


def test_a_pinned_jaw_leaves_the_brows_alone() -> None:
    """The head stays where the markers have it; if it tilted with the jaw, brows would rise."""
    world = make_world()
    noise = np.random.default_rng(1).normal(0.0, 3e-4, world.take.positions.shape)
    take = replace(world.take, positions=world.take.positions + noise)

    def solved(*pins: Pin) -> WeightsTake:
        setup = world.setup(pins=pins, neutral=(0, 3))
        shot, _ = usdface.assemble_shot(world.rig, take, setup=setup)
        options = usdface.ProcessOptions(express=False, closure=False)
        return usdface.retarget(shot, options=options).weights

    free = solved()
    at = int(free.column("jawOpen").argmax())
    pinned = solved(Pin("jawOpen", [at], [free.column("jawOpen")[at] - 0.3]))
    change = np.abs(pinned.weights - free.weights).max(axis=0)
    brows = [change[i] for i, name in enumerate(free.names) if name.startswith("brow")]
    assert max(brows) < 0.1
