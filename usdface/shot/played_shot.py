"""A processed shot as its layers hold it, in arrays: SI units, Y up.

`usdface.io.usd.played_shot` reads it from a stage. Nothing is solved again: it has the values of
the stage, including edits by an animator.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import Clip
from usdface.fuzzy.inference import Evaluation, evaluate
from usdface.rigs import Rig
from usdface.shot.shot import Shot
from usdface.takes import WeightsTake
from usdface.verdict.judge import Verdict

__all__ = ["PlayedShot"]


@dataclass(frozen=True, eq=False, slots=True)
class PlayedShot:
    """A shot with the results of `process`; parts that no layer has are empty.

    Attributes
    ----------
    rig : Rig
        All meshes, with the joints that move them.
    clip : Clip or None
        The animation of the stage, on the clock of the take: its first frame is at 0 s.
    shot : Shot
    solved : WeightsTake
        (F, T) weights before the correction.
    corrected : WeightsTake
        (F, T) weights as the stage plays them.
    markers : tuple of str, length M
        The solved markers.
    feature_points : (F, M, 3) float64 [m]
        Markers mapped to the character.
    distances : (F, M) float64 [m]
        Of each marker from the solved face; NaN where occluded.
    residual : (F,) float64 [m]
        Over all markers (RMS); no frames if the shot was not processed.
    regions : mapping of str to (F,) float64 [m]
        Over those of each region.
    head : (F, 4, 4) float64
        Pose of the performer's head in take space, row vectors, metres.
    deviations : mapping of str to float
        Standard deviation of the weight of each solved blend shape.
    emotions : mapping of str to (F,) float64
    firing : (F, R) float64
        Firing strength of each rule.
    inputs : (F, I) float64
        Inputs of the fuzzy system, in `unit`.
    unit : float [m]
    closures : mapping of str to (F,) float64
        How far "left eye", "right eye" and "mouth" are closed by the closure layer.
    start_code : float
        Time code of the first frame on the stage.
    verdict : Verdict or None

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda")
    >>> played, _ = usdface.read_result(result.written[0])
    >>> sorted(played.emotions)
    ['anger', 'disgust', 'fear', 'joy', 'sadness', 'surprise']
    """

    rig: Rig
    clip: Clip | None
    shot: Shot
    solved: WeightsTake
    corrected: WeightsTake
    markers: tuple[str, ...] = ()
    feature_points: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 3)))
    distances: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    residual: FloatArray = field(default_factory=lambda: np.zeros(0))
    regions: Mapping[str, FloatArray] = field(default_factory=dict)
    head: FloatArray = field(default_factory=lambda: np.zeros((0, 4, 4)))
    deviations: Mapping[str, float] = field(default_factory=dict)
    emotions: Mapping[str, FloatArray] = field(default_factory=dict)
    firing: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    inputs: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    unit: float = 0.0
    closures: Mapping[str, FloatArray] = field(default_factory=dict)
    start_code: float = 0.0
    verdict: Verdict | None = None

    def evaluation(self) -> Evaluation | None:
        """Return the memberships of all conditions of the rules; None without inputs.

        The fuzzy system is evaluated on the inputs that the layers hold.
        """
        system = self.shot.system
        if system is None or not len(self.inputs):
            return None
        return evaluate(system.fuzzy, self.inputs, memberships=True)
