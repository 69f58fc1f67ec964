"""A shot that is corrected again with the solve of an earlier result."""

from dataclasses import replace

import numpy as np

from usdface.content_digest import known_digest
from usdface.errors import InputError
from usdface.shot.retarget import express_again, with_overrides
from usdface.shot.run import RetargetRun
from usdface.shot.shot import Shot, ShotResult, SolvedShot
from usdface.shot.stage_inputs import inputs_beside_take

__all__ = ["correct_earlier"]


def correct_earlier(shot: Shot, earlier: ShotResult, run: RetargetRun) -> ShotResult:
    """Return the result of a shot as it is now, with the solve of an earlier one.

    Parameters
    ----------
    shot : Shot
    earlier : ShotResult
        Of the same shot; expressions, rules, gains, exaggeration and closure may be others.
    run : RetargetRun

    Raises
    ------
    InputError
        If it is the result of another shot, or of other settings of the solve.
    """
    solved = _same_solve(with_overrides(shot, run.options), earlier)
    return express_again(shot, solved, run)


def _same_solve(shot: Shot, earlier: ShotResult) -> SolvedShot:
    """Return the earlier solve, if this shot would be solved alike."""
    if earlier.solve is None:
        raise InputError(
            "the earlier result was put together by hand and holds no solve; process without it"
        )
    recorded = earlier.solve.recorded
    own = np.array_equal(shot.take.times, earlier.shot.take.times)
    if recorded:  # "": a long take in pieces, or one with values of another package
        own = own and recorded == known_digest(replace(shot.take, source=""))
    if not own or shot.rig.shape_names != earlier.shot.rig.shape_names:
        raise InputError(
            "the earlier result has another take or rig than this shot; process it without"
        )
    # "" of settings with a part from another package: only its caller knows.
    same = known_digest(inputs_beside_take(shot)) == known_digest(inputs_beside_take(earlier.shot))
    if not same:
        raise InputError(
            "the earlier result was solved with other settings, places of markers or blend shapes "
            "than this shot has now; process it without"
        )
    return earlier.solve
