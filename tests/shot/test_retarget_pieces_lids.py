"""Lids that are tracked wrongly in a take in pieces: found and replaced as in the whole take."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from closing_world import TIMES, markers, performance, shot_of
from slits import slit_face

from usdface import ProcessOptions, retarget
from usdface.closure import mistracked_lids
from usdface.findings import Finding
from usdface.io.mapped_arrays import MappedArrays
from usdface.options import CleanOptions
from usdface.shot import piece_cuts
from usdface.shot.join_pieces import join
from usdface.shot.piece_cuts import PieceCuts
from usdface.shot.retarget_pieces import EstimatedTake, estimate_shot, solve_cut
from usdface.shot.shot import Shot, SolvedShot
from usdface.takes import MarkerTake

MESH = slit_face()
NAMES = MESH.shape_names
ROUND, ROUNDS = len(TIMES), 6
FRAMES = ROUNDS * ROUND
# In one second of each round both eyes are half closed.
COURSE = np.clip(np.minimum((TIMES - 1.4) / 0.2, (2.4 - TIMES) / 0.2), 0, 1)
# The marker is lost in the middle of it, where every other block of 120 frames ends.
LOST = np.flatnonzero(np.tile((TIMES > 1.6) & (TIMES < 2.2), ROUNDS))


@dataclass
class Pieces:
    shot: Shot
    cuts: PieceCuts

    def part(self, frames: np.ndarray) -> Shot:
        take = self.shot.take
        assert isinstance(take, MarkerTake)
        own = replace(take, times=take.times[frames], positions=take.positions[frames])
        return replace(self.shot, take=own)

    def known(self) -> EstimatedTake:
        blocks = self.cuts.blocks_over(0, FRAMES)
        return estimate_shot(
            [(a, b, self.part(np.arange(*self.cuts.around(a, b)))) for a, b in blocks], self.cuts
        )

    def solved(self, known: EstimatedTake, cuts: Sequence[int], folder: Path) -> SolvedShot:
        """Return the take joined from pieces with these ends."""
        pieces = [solve_cut(self.part, self.cuts, a, b, known) for a, b in pairwise(cuts)]
        return join(pieces, known, MappedArrays(folder))


@pytest.fixture
def patched(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Short blocks, and a short reach of the judgement: a piece does not see the whole take."""
    for name, value in (
        ("BLOCK", 120),
        ("BLOCKS", 3),
        ("MARGIN", 20),
        ("STRETCH", 240),
        ("STRETCHES", 2),
    ):
        monkeypatch.setattr(piece_cuts, f"_{name}", value)
    monkeypatch.setattr(mistracked_lids, "_REACH", 1.0)
    yield monkeypatch


def lost_in(rounds: Sequence[int], patched: pytest.MonkeyPatch) -> Pieces:
    """Return a take whose right lid marker wanders up in some rounds, as `LOST` has them."""
    squint = {f"eyeBlink{side}": 0.5 * COURSE for side in ("Left", "Right")}
    one = markers(MESH, performance(NAMES, **squint))
    positions = np.concatenate([one.positions] * ROUNDS)
    positions += 2e-5 * np.random.default_rng(7).standard_normal(positions.shape)
    for number in rounds:
        frames = slice(number * ROUND, (number + 1) * ROUND)
        positions[frames, one.names.index("eye_right_up"), 1] += 0.012 * COURSE
    take = MarkerTake(one.names, np.arange(FRAMES) / 60.0, positions, 60.0)
    shot = shot_of(take, MESH, clean=CleanOptions(swaps=False, spikes=True, gaps=False))
    return Pieces(shot, PieceCuts.of(FRAMES))


def disbelieved(findings: Sequence[Finding]) -> list[Finding]:
    return [found for found in findings if found.code == "LID_DISBELIEVED"]


def right(solved: SolvedShot, rounds: Sequence[int]) -> np.ndarray:
    """Return the weights of the right eye's closing while the marker is lost in some rounds."""
    frames = LOST[np.isin(LOST // ROUND, rounds)]
    return solved.weights.column("eyeBlinkRight")[frames]


@pytest.mark.slow
@pytest.mark.parametrize(
    "rounds",
    [
        (0, 3, 5),  # the sample, the first and the last round, has two of them
        (2, 3),  # and none: estimates are of a take without
    ],
)
def test_pieces_replace_what_the_whole_replaces(
    rounds: tuple[int, ...], patched: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Wherever the cuts lie: here also within the stretches that are lost."""
    take = lost_in(rounds, patched)
    known = take.known()
    assert (known.tracked is not None) == (0 in rounds)
    assert 2 * known.reach < FRAMES
    whole = take.solved(known, (0, FRAMES), tmp_path)
    cuts = take.cuts.blocks
    assert any(abs(cut - LOST).min() == 0 for cut in cuts)
    joined = take.solved(known, cuts, tmp_path)
    np.testing.assert_allclose(joined.weights.weights, whole.weights.weights, atol=1e-9, rtol=0)
    assert isinstance(joined.take, MarkerTake) and isinstance(whole.take, MarkerTake)
    np.testing.assert_allclose(joined.take.positions, whole.take.positions, atol=1e-9, rtol=0)
    assert joined.findings == whole.findings
    assert [found.where for found in disbelieved(joined.findings)] == ["eye_right_up"]
    np.testing.assert_allclose(right(joined, range(ROUNDS)), 0.5, atol=0.1)


@pytest.mark.slow
def test_pieces_by_estimates_of_all_frames_are_as_without_pieces(
    patched: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    patched.setattr(piece_cuts, "_STRETCH", FRAMES)
    take = lost_in((1, 4), patched)
    joined = take.solved(take.known(), take.cuts.blocks, tmp_path)
    usual = retarget(take.shot, options=ProcessOptions(express=False))
    (own,), (other,) = disbelieved(joined.findings), disbelieved(usual.findings)
    assert own.values["frame_count"] == other.values["frame_count"]
    np.testing.assert_allclose(joined.weights.weights, usual.solved.weights, atol=1e-4)


@pytest.mark.slow
def test_lids_are_judged_only_where_takes_are_cleaned(
    patched: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    take = lost_in((1,), patched)
    setup = replace(take.shot.setup, clean=CleanOptions(swaps=False, spikes=False, gaps=False))
    take = replace(take, shot=replace(take.shot, setup=setup))
    known = take.known()
    assert (known.judged, known.lids) == (0, None)
    joined = take.solved(known, take.cuts.pieces, tmp_path)
    assert not disbelieved(joined.findings)
    assert right(joined, (1,)).max() < 0.2
