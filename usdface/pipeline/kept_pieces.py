"""The estimates and the solved pieces of a long take, kept in a folder."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.arrays import IntArray
from usdface.io.asset_folder import asset_folder
from usdface.io.atomic import StrPath, check_place
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot, shot_frames
from usdface.options import ProcessOptions
from usdface.rigs import Rig
from usdface.shot.correct import check_gains
from usdface.shot.piece_cuts import PieceCuts
from usdface.shot.retarget import with_overrides
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece, estimate_shot, solve_cut
from usdface.shot.shot import Shot
from usdface.shot.stage_inputs import solve_inputs
from usdface.show.stage_cache import StageCache

__all__ = ["KeptPieces"]


class KeptPieces:
    """The pieces of one shot, kept in a folder.

    Parameters
    ----------
    shot : Path
    folder : Path
    options : ProcessOptions
    asset_root : path, optional

    Raises
    ------
    OutputError
        If the folder is a file, or cannot be written to.
    """

    def __init__(
        self, shot: Path, folder: Path, options: ProcessOptions, asset_root: StrPath | None
    ) -> None:
        check_place(folder / f"{shot.stem}.npz")
        self._where = shot
        self._cache = StageCache(folder, shot.stem, must_keep=True)
        self._options = options
        self._stage = open_shot(shot, None)
        self._assets = asset_folder(asset_root)
        self._rig: Rig | None = None
        self.cuts = PieceCuts.of(shot_frames(self._stage, str(shot)))

    def read(self, frames: IntArray) -> Shot:
        """Return the shot with some frames of its take, and the options of this run."""
        staged, _ = read_shot(self._stage, str(self._where), self._assets, frames)
        self._rig = self._rig or staged.shot.rig  # one for all, in memory
        return with_overrides(replace(staged.shot, rig=self._rig), self._options)

    def estimates(self) -> EstimatedTake:
        """Return the estimates of the take, from the folder or computed from its sample."""
        first_frame = self.read(np.array([0]))
        check_gains(first_frame, self._options.gains)
        sample = self.cuts.sample(first_frame.setup.neutral)
        blocks = [
            (first, end, self.read(np.arange(*self.cuts.around(first, end))))
            for first, end in self.cuts.blocks_over(0, self.cuts.frames)
            if ((sample >= first) & (sample < end)).any()
        ]
        inputs = [(first, solve_inputs(part)) for first, _, part in blocks]
        return self._cache.stage(
            "estimates", (inputs, self.cuts.blocks), {}, lambda: estimate_shot(blocks, self.cuts)
        )

    def piece(self, number: int, known: EstimatedTake) -> SolvedPiece:
        """Return a piece, from the folder or solved."""
        first, end = self.cuts.piece(number)
        blocks = list(self.cuts.blocks_over(*self.cuts.reached(first, end, known.reach)))
        shot = self.read(np.arange(*self.cuts.around(blocks[0][0], blocks[-1][1])))
        inputs = (solve_inputs(shot), known, self.cuts.pieces, number)
        return self._cache.stage(
            f"piece{number:05}",
            inputs,
            {},
            lambda: solve_cut(lambda frames: shot, self.cuts, first, end, known),
        )

    @property
    def used(self) -> dict[str, str]:
        """The origin of estimates and pieces, by name: "cached" or "computed"."""
        return self._cache.used
