"""The closure layer: eyes and lips that close on the performer close on the character.

It runs after the correction, which therefore cannot reopen eyes or lips. A second run on its own
weights, by the same solve, changes hardly any: those of the mouth by less than 0.001, where a part
of a closure was done, as the rest of it is found anew.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.closure.closed_eyes import CompletedClosing, close_eyes
from usdface.closure.closed_lips import close_lips
from usdface.closure.lid_apertures import Eye, LidApertures, lid_apertures_of
from usdface.closure.solved_performance import SolvedPerformance
from usdface.findings import Finding
from usdface.options import ClosureOptions

__all__ = ["Closure", "close_eyes_and_lips"]


@dataclass(frozen=True, eq=False, slots=True)
class Closure:
    """Weights of closed eyes and lips.

    Attributes
    ----------
    weights : (F, T) float64
    eyes : (F, 2) float64
        How far the left and the right eye are closed by the layer: 0 as they were, 1 closed.
    mouth : (F,) float64
        The same of the lips.
    closings : tuple of CompletedClosing
    findings : tuple of Finding
    """

    weights: FloatArray
    eyes: FloatArray
    mouth: FloatArray
    closings: tuple[CompletedClosing, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "weights", "eyes", "mouth")


def close_eyes_and_lips(
    performance: SolvedPerformance,
    weights: FloatArray,
    *,
    options: ClosureOptions = ClosureOptions(),
    by_eye: Mapping[Eye, LidApertures] | None = None,
    blink: FloatArray | None = None,
) -> Closure | None:
    """Bring lips together that touch, complete the blinks of a take, and part lids that cross.

    Parameters
    ----------
    performance : SolvedPerformance
        The lips of a take of weights stay as they are. Pinned weights stay, and the layer fades
        towards them.
    weights : (F, T) float64
        The weights to close, corrected or not.
    options : ClosureOptions
    by_eye : mapping of "left", "right" to LidApertures, optional
        Of the T blend shapes, where they were measured before.
    blink : (F,) float64, optional
        `usdface.takes.MarkerTake.blink`.

    Returns
    -------
    Closure or None
        None where nothing is to close, or the face has neither lids nor lips.
    """
    performance = replace(performance, face=performance.face.with_contacts())
    lips = close_lips(performance, weights) if options.lips else None
    eyes = None
    if options.lids:
        # Last: a jaw that closes the lips may move the lower lids a little.
        lower = weights if lips is None else lips.weights
        if by_eye is None:
            by_eye = lid_apertures_of(performance.face, performance.solved.names)
        eyes = close_eyes(performance, lower, by_eye, blink)
    if lips is None and eyes is None:
        return None
    closure = Closure(weights, np.zeros((len(weights), 2)), np.zeros(len(weights)))
    if lips is not None:
        closure = replace(
            closure, weights=lips.weights, mouth=lips.course, findings=tuple(lips.findings)
        )
    if eyes is not None:
        closure = replace(
            closure,
            weights=eyes.weights,
            eyes=eyes.course,
            closings=eyes.closings,
            findings=(*closure.findings, *eyes.findings),
        )
    return closure
