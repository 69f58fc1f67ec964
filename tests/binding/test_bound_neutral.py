"""Neutral frames that are looked for where the markers are bound: the rig judges them."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, filmed, make_world

from usdface.binding.bound_neutral import bound_neutral
from usdface.binding.neutral_frames import neutral_frames
from usdface.binding.resolve_binding import resolve_binding
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace, bound_face
from usdface.options import BindOptions
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace
from usdface.shot.assembly import assemble_shot
from usdface.takes import MarkerTake

FOUND = BindOptions(neutral="auto")


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def held(world: World) -> MarkerTake:
    """A take that holds an expression for longer than its rest."""
    pose = np.repeat(world.take.positions[12:13], 60, axis=0)
    return with_positions(world.take, np.concatenate([world.take.positions, pose]))


def with_positions(take: MarkerTake, positions: np.ndarray) -> MarkerTake:
    return replace(take, positions=positions, times=np.arange(len(positions)) / take.rate)


def test_the_neutral_is_the_held_pose_from_which_the_rig_explains_the_others(
    world: World, held: MarkerTake
) -> None:
    resolved = resolve_binding(world.rig, held, world.setup(), options=FOUND)
    assert resolved.setup.neutral is not None
    first, last = resolved.setup.neutral
    assert 0 <= first <= last < NEUTRAL + 4
    assert resolved.neutral_found and not resolved.setup.neutral_weights
    assert neutral_frames(held)[0] > 30  # as the markers alone have it


def test_markers_that_are_occluded_in_the_held_pose_do_not_matter(
    world: World, held: MarkerTake
) -> None:
    positions = held.positions.copy()
    positions[45:, [held.names.index("chin"), held.names.index("corner_l")]] = np.nan
    positions[:, held.names.index("temple_l")] = np.nan  # never seen at all
    face = bound_face(world.rig.meshes[0], world.setup())
    assert bound_neutral(replace(held, positions=positions), face)[1] < NEUTRAL + 4


def test_three_bound_markers_leave_it_to_all_markers(world: World, held: MarkerTake) -> None:
    some = ("nose", "chin", "brow")
    few = BoundFace(world.rig.meshes[0], some, np.array([world.points[name] for name in some]))
    assert bound_neutral(held, few) == neutral_frames(held)


def test_unbound_markers_of_an_image_do_not_matter(world: World, held: MarkerTake) -> None:
    face = bound_face(world.rig.meshes[0], world.setup())
    take = filmed(held)
    wild = 1000.0 * np.random.default_rng(0).random((len(take.times), 1, 2))
    names, positions = ("stray", *take.names), np.concatenate([wild, take.positions], axis=1)
    more = replace(take, names=names, positions=positions)
    assert bound_neutral(more, face) == bound_neutral(take, face)
    assert bound_neutral(take, face)[1] < NEUTRAL + 4


def test_five_bound_markers_of_an_image_are_too_few(world: World, held: MarkerTake) -> None:
    some = tuple(world.points)[:5]
    few = BoundFace(world.rig.meshes[0], some, np.array([world.points[name] for name in some]))
    with pytest.raises(InputError, match=r"shows 6 bound markers.*--neutral 0 30"):
        bound_neutral(filmed(held), few)
    nobody = BoundFace(world.rig.meshes[0], (), np.zeros(0, dtype=np.int64))
    with pytest.raises(InputError, match="shows 6 bound markers"):
        bound_neutral(filmed(held), nobody)


@pytest.fixture(scope="module")
def two_ways(world: World) -> tuple[World, MarkerTake]:
    """A rig whose shape has an opposite, and a take that holds the shape: either is a rest."""
    mesh = world.rig.meshes[0]
    brow = next(shape for shape in mesh.shapes if shape.name == "browInnerUp")
    shapes = (brow, BlendShape("browInnerDown", brow.indices, -brow.offsets))
    rig = replace(world.rig, meshes=(replace(mesh, shapes=shapes),))
    weights = np.concatenate([np.ones(80), np.linspace(1, 0, 20), np.zeros(40)])
    move = rig.meshes[0].offsets_at(list(world.points.values()))[0]
    positions = world.take.positions[:1] + weights[:, None, None] * move
    return replace(world, rig=rig), with_positions(world.take, positions)


def test_the_resting_markers_of_the_performer_tell_what_the_rig_does_not(
    two_ways: tuple[World, MarkerTake],
) -> None:
    world, take = two_ways
    rest = 1000.0 * take.positions[-1] + 5.0  # another unit and origin
    performer = PerformerFace(
        take.names,
        np.array([world.points[name] for name in take.names]),
        np.zeros_like(rest),
        rest,
        30,
        ("browInnerUp",),
        np.zeros((1, *rest.shape)),
    )
    known = Calibration((), np.zeros(0), np.zeros(0), performer)
    shots = [
        assemble_shot(world.rig, take, setup=world.setup(), binding=FOUND, calibration=calibration)
        for calibration in (None, known)
    ]
    without, found = (shot.setup.neutral for shot, _ in shots)
    assert without is not None and found is not None
    assert without[1] < 90 and found[0] > 90
    # A stranger's file, whose markers have other names, says nothing.
    stranger = replace(performer, markers=tuple(f"m{i}" for i in range(len(rest))))
    face = bound_face(world.rig.meshes[0], world.setup())
    assert bound_neutral(take, face, stranger) == without
