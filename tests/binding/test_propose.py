from dataclasses import replace

import numpy as np
import pytest
from worlds import NEUTRAL, World, make_world

from usdface.binding.neutral_frames import neutral_frames
from usdface.binding.proposal import proposal_findings
from usdface.binding.propose import propose as proposed
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.rigs import BlendShape, Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

NO_BINDING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral=(0, NEUTRAL - 1))


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def turned(seed: int) -> tuple[np.ndarray, float]:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn)), float(rng.uniform(0.7, 1.5))


def anonymous(world: World, seed: int) -> tuple[MarkerTake, np.ndarray]:
    """The world's take turned, scaled, moved and shuffled without its names; the true vertices."""
    turn, scale = turned(seed)
    order = np.random.default_rng(seed).permutation(len(world.points))
    positions = scale * (world.take.positions[:, order] @ turn.T) + [1.0, -2.0, 3.0]
    names = tuple(f"m{i}" for i in range(len(order)))
    take = MarkerTake(names, world.take.times, positions, world.take.rate, source="take.trc")
    return take, np.array(list(world.points.values()))[order]


def with_positions(take: MarkerTake, positions: np.ndarray, *more: str) -> MarkerTake:
    return replace(take, names=take.names + more, positions=positions)


def found(world: World, take: MarkerTake, setup: RetargetSetup = NO_BINDING) -> dict[str, int]:
    binding = propose(take, world.rig.meshes[0], setup)[0].binding
    return dict(zip(binding.markers, binding.points.tolist(), strict=True))


def propose(
    take: MarkerTake, mesh: Mesh, setup: RetargetSetup, *, find_neutral: bool = False
) -> tuple[RetargetSetup, list[Finding]]:
    proposal = proposed(take, mesh, setup, find_neutral=find_neutral)
    return proposal.setup, proposal_findings(proposal, take.source)


def codes(findings: list[Finding], code: str) -> list[str]:
    return [f.where for f in findings if f.code == code]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_anonymous_markers_in_any_pose_and_size_find_their_vertices(
    world: World, seed: int
) -> None:
    take, truth = anonymous(world, seed)
    proposal, findings = propose(take, world.rig.meshes[0], NO_BINDING)
    assert proposal.binding.markers == take.names
    np.testing.assert_array_equal(proposal.binding.points, truth)
    assert proposal.binding.confidence is not None
    assert proposal.binding.confidence.min() > 0.8
    assert [f.code for f in findings] == ["BIND_PROPOSED"]


@pytest.mark.slow
@pytest.mark.usefixtures("as_users_have_it")
def test_vertices_whose_confidence_fails_are_proposed_without_one(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> np.ndarray:
        raise MemoryError

    monkeypatch.setattr("usdface.binding.placed_markers.placement_confidence", fail)
    take, truth = anonymous(world, 1)
    proposal, findings = propose(take, world.rig.meshes[0], NO_BINDING)
    np.testing.assert_array_equal(proposal.binding.points, truth)
    assert proposal.binding.confidence is not None
    assert np.isnan(proposal.binding.confidence).all()
    assert [f.code for f in findings] == ["ADVICE_FAILED", "BIND_PROPOSED"]


@pytest.mark.slow
def test_places_that_are_given_stay(world: World) -> None:
    take, truth = anonymous(world, 3)
    chosen = np.array([0, 9, 14])
    beside = truth[chosen] + [0, 1, 0]
    given = Binding(tuple(take.names[i] for i in chosen), beside)
    proposal, _ = propose(take, world.rig.meshes[0], replace(NO_BINDING, binding=given))
    binding = proposal.binding
    assert binding.markers[:3] == given.markers and set(binding.markers) == set(take.names)
    np.testing.assert_array_equal(binding.points[:3], given.points)
    assert binding.confidence is not None
    np.testing.assert_array_equal(binding.confidence[:3], 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("count", [4, pytest.param(2, marks=pytest.mark.slow)])
def test_a_given_place_that_is_wrong_is_named_and_not_followed(world: World, count: int) -> None:
    take, truth = anonymous(world, 3)
    chosen = np.array([0, 9, 14, 18])[:count]
    points = world.rig.meshes[0].points
    far = np.linalg.norm(points[truth] - points[truth[9]], axis=1).argmax()
    places = truth[chosen]
    places[1] = truth[far]
    given = Binding(tuple(take.names[i] for i in chosen), places)
    setup, findings = propose(take, world.rig.meshes[0], replace(NO_BINDING, binding=given))
    assert codes(findings, "PLACE_DOUBTED") == ["m9"]
    binding = setup.binding
    # A person's word stays, but is said to be unsure.
    np.testing.assert_array_equal(binding.points[:count], places)
    assert binding.confidence is not None
    np.testing.assert_array_equal(binding.confidence[:count], np.arange(count) != 1)
    placed = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    others = [i for i in range(len(truth)) if i not in chosen]
    assert np.mean([placed[f"m{i}"] == truth[i] for i in others]) > 0.85


def test_three_anchors_hold_what_motion_alone_does_not(world: World) -> None:
    """Four still markers on a face that hardly moves: only the anchors can tell their places."""
    names = ("chin", "nose", "brow_out_l", "brow_out_r", "forehead", "cheek_l", "cheek_r", "jaw_l")
    take = replace(world.take, names=names, positions=world.take.select(names))
    held = Binding(names[1:4], np.array([world.points[n] for n in names[1:4]]))
    places = found(world, take, replace(NO_BINDING, binding=held))
    points = world.rig.meshes[0].points
    off = [np.linalg.norm(points[places[n]] - points[world.points[n]]) for n in names]
    assert max(off) < 0.015


@pytest.mark.slow
def test_hidden_markers_do_not_spoil_the_others(world: World) -> None:
    take, truth = anonymous(world, 4)
    positions = take.positions.copy()
    hidden = np.random.default_rng(0).random(positions.shape[:2]) < 0.15
    hidden[:NEUTRAL] = False
    positions[hidden] = np.nan
    positions[:, 7] = np.nan
    proposal, findings = propose(with_positions(take, positions), world.rig.meshes[0], NO_BINDING)
    assert codes(findings, "MARKER_NEVER_SEEN") == ["m7"]
    binding = proposal.binding
    assert binding.markers == take.names[:7] + take.names[8:]
    assert (binding.points == np.delete(truth, 7)).mean() > 0.9


@pytest.mark.slow
def test_what_is_not_on_the_face_is_left_out_and_named(world: World) -> None:
    take, truth = anonymous(world, 5)
    turn, scale = turned(5)
    # Half a metre below: on the chest, which does not turn with the head.
    chest = scale * (np.array([0.02, -0.5, 0.0]) @ turn.T) + [1.0, -2.0, 3.0]
    copy = take.positions[:, 3]
    more = np.stack([np.broadcast_to(chest, copy.shape), copy], axis=1)
    positions = np.concatenate([take.positions, more], axis=1)
    take = with_positions(take, positions, "chest", "copy")
    proposal, findings = propose(take, world.rig.meshes[0], NO_BINDING)
    assert codes(findings, "MARKER_OFF_FACE") == ["chest"]
    assert codes(findings, "MARKER_DUPLICATE") == ["copy"]
    np.testing.assert_array_equal(proposal.binding.points, truth)


@pytest.mark.slow
def test_markers_that_fit_no_face_are_said_to_be_unsure(world: World) -> None:
    rng = np.random.default_rng(0)
    rest = 0.1 * rng.normal(size=(20, 3))
    swing = 0.01 * rng.normal(size=(3, 20, 3))
    curves = rng.normal(size=(40, 3)).cumsum(axis=0)
    positions = rest + np.einsum("fk,kmd->fmd", curves, swing)
    take = MarkerTake(tuple(f"m{i}" for i in range(20)), np.arange(40) / 30, positions)
    _, findings = propose(take, world.rig.meshes[0], NO_BINDING)
    assert codes(findings, "BIND_UNSURE")


@pytest.mark.slow
def test_a_proposal_is_the_same_twice(world: World) -> None:
    take, _ = anonymous(world, 6)
    first, second = (propose(take, world.rig.meshes[0], NO_BINDING)[0] for _ in range(2))
    assert first.peaks == second.peaks
    for one, other in (
        (first.binding.points, second.binding.points),
        (first.binding.confidence, second.binding.confidence),
    ):
        np.testing.assert_array_equal(one, other)


def test_what_cannot_be_proposed_is_one_clear_line(world: World) -> None:
    mesh, take = world.rig.meshes[0], world.take
    flat = replace(take, positions=take.positions[..., :2])
    with pytest.raises(InputError, match="is of an image"):
        propose(flat, mesh, NO_BINDING)
    with pytest.raises(InputError, match="is of an image"):
        neutral_frames(flat)
    few = replace(take, names=take.names[:5], positions=take.positions[:, :5])
    with pytest.raises(InputError, match="shows 5 markers"):
        propose(few, mesh, NO_BINDING)
    names = take.names[:5] + tuple(f"{name} again" for name in take.names[:5])
    copied = replace(take, names=names, positions=take.positions[:, [0, 1, 2, 3, 4] * 2])
    with pytest.raises(InputError, match="shows 5 markers at different places"):
        propose(copied, mesh, NO_BINDING)
    apart = take.positions.copy()
    for frame, positions in enumerate(apart):  # never two of them at once
        positions[np.arange(len(take.names)) != frame % len(take.names)] = np.nan
    with pytest.raises(InputError, match=r"no frame of the take .* shows"):
        propose(replace(take, positions=apart), mesh, NO_BINDING)
    lost = replace(take, positions=np.full_like(take.positions, np.nan))
    with pytest.raises(InputError, match="shows 0 markers"):
        propose(lost, mesh, NO_BINDING)
    with pytest.raises(InputError, match="no frame"):
        neutral_frames(lost)
    still = replace(take, positions=np.repeat(take.positions[:1], len(take.times), axis=0))
    with pytest.raises(InputError, match="does not move"):
        propose(still, mesh, NO_BINDING)
    with pytest.raises(InputError, match="lie outside the take"):
        propose(take, mesh, replace(NO_BINDING, neutral=(0, 99)))
    wide, high = (each.ravel() for each in np.meshgrid(range(5), range(4)))
    points = 0.01 * np.stack([wide, high, 0 * wide], axis=1)
    first = np.flatnonzero((wide < 4) & (high < 3))
    quads = first[:, None] + [0, 1, 6, 5]
    closing = BlendShape("eyeBlinkLeft", np.arange(20), np.tile([0.0, -0.005, 0.0], (20, 1)))
    lashes = Mesh("lashes", points, np.full(12, 4), quads.ravel(), shapes=(closing,))
    with pytest.raises(InputError, match="only 20 vertices for 23 markers"):
        propose(take, lashes, NO_BINDING)


def test_the_neutral_is_where_the_face_rests(world: World) -> None:
    first, last = neutral_frames(world.take)
    # The world's shapes come in on frame 5 at the earliest, by a few percent.
    assert first == 0 and NEUTRAL - 1 <= last <= NEUTRAL + 2


def test_a_neutral_that_is_looked_for_explains_the_peaks(world: World) -> None:
    """The face holds a pose of its own for longer than its neutral."""
    held = np.repeat(world.take.positions[12:13], 60, axis=0)
    positions = np.concatenate([world.take.positions, held])
    times = np.arange(len(positions)) / world.take.rate
    take = replace(world.take, positions=positions, times=times)
    some = ("nose", "brow_out_l", "brow_out_r", "chin")
    held_by = Binding(some, np.array([world.points[name] for name in some]))
    setup = RetargetSetup(held_by, neutral=(0, 0))
    proposal, _ = propose(take, world.rig.meshes[0], setup, find_neutral=True)
    assert proposal.neutral is not None
    first, last = proposal.neutral
    assert 0 <= first <= last < NEUTRAL + 4
    assert neutral_frames(take)[0] > 30
