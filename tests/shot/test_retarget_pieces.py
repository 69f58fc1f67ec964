"""A take in pieces: with the same estimates every frame has the weights of the whole."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from curved_world import make_curved_world
from worlds import World, make_world

from usdface.cleanup.clean import clean_take
from usdface.cleanup.repairs import Repair
from usdface.errors import InputError, SolveError
from usdface.io.mapped_arrays import MappedArrays
from usdface.options import HeadMode
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot import piece_cuts
from usdface.shot.join_pieces import join
from usdface.shot.piece_cuts import PieceCuts
from usdface.shot.retarget import retarget
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece, estimate_shot, solve_cut
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

FRAMES, NEUTRAL = 900, 12
ORDER = np.concatenate([np.zeros(NEUTRAL, int), np.resize(np.arange(40), FRAMES - NEUTRAL)])


@dataclass
class Solved:
    shot: Shot
    cuts: PieceCuts
    known: EstimatedTake
    whole: SolvedPiece

    def read(self, frames: np.ndarray) -> Shot:
        return part(self.shot, frames)


@pytest.fixture(scope="module")
def solved() -> Iterator[Solved]:
    """The world's motion again and again, with noise, occluded markers and a spike."""
    world = make_world()
    chance = np.random.default_rng(3)
    noise = 2e-4 * chance.standard_normal((FRAMES, *world.take.positions.shape[1:]))
    positions = world.take.positions[ORDER] + noise
    for number, first in enumerate(range(30, FRAMES - 20, 50)):
        positions[first : first + 9, number % 20] = np.nan
    positions[700, 2] += 0.05
    shot = shot_of(world, positions)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (
            ("BLOCK", 128),
            ("BLOCKS", 3),
            ("MARGIN", 32),
            ("STRETCH", 24),
            ("STRETCHES", 6),
        ):
            patch.setattr(piece_cuts, f"_{name}", value)
        cuts = PieceCuts.of(FRAMES)
        known = estimated(shot, cuts)
        whole = solve_cut(lambda frames: part(shot, frames), cuts, 0, FRAMES, known)
        yield Solved(shot, cuts, known, whole)


def shot_of(world: World, positions: np.ndarray) -> Shot:
    blink = np.linspace(0.0, 1.0, len(positions))
    times = np.arange(len(positions)) / 30.0
    take = MarkerTake(world.take.names, times, positions, 30.0, blink=blink)
    binding = Binding(tuple(world.points), np.array(list(world.points.values())), "head")
    setup = RetargetSetup(binding, neutral=(0, 3), nose_tip="nose")
    return Shot(world.rig, take, setup)


def part(shot: Shot, frames: np.ndarray) -> Shot:
    take = shot.take
    assert isinstance(take, MarkerTake)
    return replace(shot, take=take.with_frames(frames))


def estimated(shot: Shot, cuts: PieceCuts) -> EstimatedTake:
    blocks = cuts.blocks_over(0, cuts.frames)
    return estimate_shot(
        [(a, b, part(shot, np.arange(*cuts.around(a, b)))) for a, b in blocks], cuts
    )


@pytest.mark.slow
def test_pieces_have_the_weights_of_the_whole(solved: Solved, tmp_path: Path) -> None:
    cuts, known, whole = solved.cuts, solved.known, solved.whole
    assert len(cuts) == 3
    pieces = [solve_cut(solved.read, cuts, *cuts.piece(k), known) for k in range(len(cuts))]
    joined = join(pieces, known, MappedArrays(tmp_path))
    for field in ("feature_points", "residual", "distances"):
        np.testing.assert_allclose(
            getattr(joined.solution, field), getattr(whole.solution, field), atol=1e-9, rtol=0
        )
    np.testing.assert_allclose(
        joined.weights.weights, whole.solution.weights.weights, atol=1e-9, rtol=0
    )
    assert isinstance(joined.take, MarkerTake)
    np.testing.assert_array_equal(joined.take.positions, whole.take.positions)
    np.testing.assert_array_equal(joined.weights.times, solved.shot.take.times)
    np.testing.assert_array_equal(joined.take.blink, solved.shot.take.blink)
    assert joined.repairs == join([whole], known, MappedArrays(tmp_path)).repairs
    assert joined.findings == join([whole], known, MappedArrays(tmp_path)).findings
    codes = {found.code for found in joined.findings}
    assert {"MARKER_SPIKE", "MARKER_FILLED", "MARKER_OCCLUDED", "TAKE_SAMPLED"} <= codes


@pytest.mark.slow
def test_without_overlap_they_have_not(solved: Solved) -> None:
    first, end = solved.cuts.piece(1)
    alone = solve_cut(solved.read, solved.cuts, first, end, replace(solved.known, overlap=0))
    away = np.abs(
        alone.solution.weights.weights - solved.whole.solution.weights.weights[first:end]
    ).max(axis=1)
    assert away[0] > 1e-6 and away[-1] > 1e-6
    reach = solved.known.overlap
    assert away[reach:-reach].max(initial=0.0) < 1e-9


@pytest.mark.slow
def test_a_piece_in_which_the_face_is_out_of_sight_has_the_pose_beside_it(
    solved: Solved, tmp_path: Path
) -> None:
    first, end = solved.cuts.piece(1)
    known = replace(solved.known, overlap=32)
    take = solved.shot.take
    assert isinstance(take, MarkerTake)
    positions = take.positions.copy()
    positions[first - 128 : end + 128] = np.nan
    left = replace(solved, shot=replace(solved.shot, take=replace(take, positions=positions)))
    pieces = [solve_cut(left.read, left.cuts, *left.cuts.piece(k), known) for k in range(3)]
    joined = join(pieces, known, MappedArrays(tmp_path))
    assert joined.solution is not None and np.isfinite(joined.weights.weights).all()
    turns = joined.solution.pose.rotations
    np.testing.assert_array_equal(turns[first], turns[first - 129])
    np.testing.assert_array_equal(turns[end], turns[end + 128])
    codes = {found.code for found in joined.findings}
    assert {"HEAD_MARKERS_FEW", "FRAME_UNSOLVED"} <= codes


@pytest.mark.slow
@pytest.mark.parametrize("head", ["markers", "stabilised"])
def test_a_head_that_its_own_markers_show_moves_on_where_the_face_is_hidden(
    solved: Solved, tmp_path: Path, head: HeadMode
) -> None:
    """And the pose of a stabilised head is known without any marker."""
    world, rigid = make_world(), ("temple_l", "temple_r", "forehead", "bridge")
    bound = [name for name in world.take.names if head == "stabilised" or name not in rigid]
    positions = world.take.positions[ORDER]
    positions[500:520, [world.take.names.index(name) for name in bound]] = np.nan
    setup = replace(
        solved.shot.setup,
        binding=Binding(tuple(bound), np.array([world.points[name] for name in bound]), "head"),
        head=head,
        head_markers=rigid if head == "markers" else (),
    )
    shot = replace(shot_of(world, positions), setup=setup)
    cuts = solved.cuts
    known = estimated(shot, cuts)
    pieces = [
        solve_cut(lambda frames: part(shot, frames), cuts, *cuts.piece(k), known)
        for k in range(len(cuts))
    ]
    joined, usual = join(pieces, known, MappedArrays(tmp_path)), retarget(shot)
    assert joined.solution is not None and usual.solution is not None
    np.testing.assert_allclose(
        joined.solution.pose.rotations, usual.solution.pose.rotations, atol=1e-9, rtol=0
    )
    codes = {found.code for found in joined.findings}
    assert "FRAME_UNSOLVED" in codes and "HEAD_MARKERS_FEW" not in codes


@pytest.mark.slow
def test_labels_exchanged_beside_a_cut_are_put_right_as_in_the_whole_take(solved: Solved) -> None:
    """One of them is hidden from before the cut of two blocks until after it."""
    first, _ = solved.cuts.piece(1)
    take = solved.shot.take
    assert isinstance(take, MarkerTake)
    positions, pair = take.positions.copy(), [3, 14]
    exchanged = slice(first - 14, first + 10)
    positions[exchanged, pair] = positions[exchanged, pair[::-1]]
    positions[first - 14 : first + 4, 3] = np.nan
    broken = replace(take, positions=positions)
    cleaned, _ = clean_take(broken, take.names, solved.shot.setup.clean)
    left = replace(solved, shot=replace(solved.shot, take=broken))
    pieces = [solve_cut(left.read, left.cuts, *left.cuts.piece(k), solved.known) for k in range(2)]
    found = swapped([repair for piece in pieces for repair in piece.repairs])
    assert found == swapped(cleaned.repairs)
    assert found == {(take.names[m], f) for m in pair for f in range(first - 14, first + 10)}


@pytest.mark.slow
def test_in_the_block_of_the_neutral_frames_their_labels_are_right(solved: Solved) -> None:
    """The labels are exchanged over most of it."""
    take, pair, exchanged = solved.shot.take, [3, 14], slice(20, 150)
    assert isinstance(take, MarkerTake)
    positions = take.positions.copy()
    positions[exchanged, pair] = positions[exchanged, pair[::-1]]
    left = replace(solved, shot=replace(solved.shot, take=replace(take, positions=positions)))
    piece = solve_cut(left.read, left.cuts, *left.cuts.piece(0), solved.known)
    assert swapped(piece.repairs) == {(take.names[m], f) for m in pair for f in range(20, 150)}


def swapped(repairs: Sequence[Repair]) -> set[tuple[str, int]]:
    """Return markers and frames of the repairs of swaps."""
    swaps = [repair for repair in repairs if repair.kind == "swap"]
    return {(swap.marker, f) for swap in swaps for f in range(swap.first, swap.last + 1)}


@pytest.mark.slow
def test_the_weights_are_nearly_as_near_the_true_ones_as_without_pieces(solved: Solved) -> None:
    truth = make_world().weights[ORDER]
    usual = retarget(solved.shot).solved
    errors = [
        np.sqrt(((weights.weights - truth) ** 2).mean())
        for weights in (solved.whole.solution.weights, usual)
    ]
    assert errors[0] < 1.3 * errors[1], errors  # of a sixth of the frames


def test_a_take_of_one_frame_is_one_piece() -> None:
    world = make_world()
    shot = shot_of(world, world.take.positions[:1])
    shot = replace(shot, setup=replace(shot.setup, neutral=(0, 0)))
    cuts = PieceCuts.of(1)
    known = estimated(shot, cuts)
    assert known.overlap == 0
    piece = solve_cut(lambda frames: part(shot, frames), cuts, 0, 1, known)
    np.testing.assert_allclose(piece.solution.weights.weights, 0.0, atol=1e-9)


@pytest.mark.slow
def test_what_is_not_solved_in_pieces_is_refused(solved: Solved) -> None:
    weights = WeightsTake(("jawOpen",), np.arange(9.0), np.zeros((9, 1)))
    with pytest.raises(InputError, match="as a whole"):
        estimate_shot([(0, 9, replace(solved.shot, take=weights))], PieceCuts.of(9))
    take = solved.shot.take
    assert isinstance(take, MarkerTake)
    image = replace(take, positions=take.positions[..., :2])
    with pytest.raises(InputError, match="image points"):
        estimate_shot([(0, FRAMES, replace(solved.shot, take=image))], PieceCuts.of(FRAMES))
    curved = make_curved_world()
    with pytest.raises(SolveError, match="inbetweens"):
        estimated(shot_of(curved, curved.take.positions), PieceCuts.of(40))
