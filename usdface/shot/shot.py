"""A shot in memory: a character, a take and their setup; and its result. Arrays in SI units, Y up.

`usdface.io.usd.shot` reads a `Shot` from a stage, `usdface.retarget` turns it into a `ShotResult`,
and `usdface.io.usd.layers` writes that back. No step between them needs a stage.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, freeze
from usdface.cleanup.repairs import Repair
from usdface.closure.closure_layer import Closure
from usdface.closure.lid_apertures import Eye, LidApertures
from usdface.closure.mistracked_lids import MistrackedLid
from usdface.correction.expression_layer import ExpressionTrace
from usdface.correction.gains import Gains
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace, bound_face
from usdface.face.layout import FaceLayout
from usdface.findings import Finding
from usdface.geometry.rigid_fit import Pose
from usdface.read_only import make_read_only
from usdface.retarget.exaggeration import Exaggeration
from usdface.retarget.joint_motion import JointMotion
from usdface.retarget.solution import Solution
from usdface.rigs import Mesh, Rig
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup
from usdface.short_repr import short_repr
from usdface.shot.followers import followers
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Shot", "ShotResult", "SolvedShot"]

_SAME = 1e-6  # of a weight: weights went through float32


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Shot:
    """Everything a retarget needs.

    Attributes
    ----------
    rig : Rig
    take : MarkerTake or WeightsTake
        F frames.
    setup : RetargetSetup
    system : ExpressionSystem or None
        None: no expression layer.
    expressions : tuple of Expression
        The pose of each emotion.
    layout : FaceLayout
        Sides, regions, antagonists and contacts of the face.
    gains : Gains or None
        Strength of the correction over the take; None: that of the system and the expressions.
    exaggeration : Exaggeration or None
        Factors on the solved weights over the take; None: those of the setup.
    base : WeightsTake or None
        Weights of the character's own animation at the times of the take. Blend shapes that the
        retarget does not solve keep them.

    Raises
    ------
    InputError
        If the base has not as many frames as the take.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> take, _ = usdface.read_take("examples/take.usdc")
    >>> setup, _ = usdface.read_bind("examples/bind.json")
    >>> usdface.Shot(rig, take, setup).system is None  # no expression layer, see assemble_shot
    True
    """

    __repr__ = short_repr

    rig: Rig
    take: MarkerTake | WeightsTake
    setup: RetargetSetup
    system: ExpressionSystem | None = None
    expressions: tuple[Expression, ...] = ()
    layout: FaceLayout = field(default_factory=FaceLayout)
    gains: Gains | None = None
    base: WeightsTake | None = None
    exaggeration: Exaggeration | None = None

    def __post_init__(self) -> None:
        if self.base is not None and len(self.base.times) != len(self.take.times):
            raise InputError(
                f"the base weights have {len(self.base.times)} frames, the take "
                f"{len(self.take.times)}; expected as many",
                "WEIGHTS_LENGTH_WRONG",
            )

    @property
    def mesh(self) -> Mesh:
        """The bound mesh."""
        return self.rig.mesh(self.setup.binding.mesh)

    @property
    def factors(self) -> Exaggeration:
        """The exaggeration over the take, or the constant one of the setup."""
        return self.exaggeration or Exaggeration.constant(self.setup.exaggeration)

    @property
    def face(self) -> BoundFace:
        """The bound mesh with its markers and its layout."""
        rig_shapes = self.rig.shape_names
        return bound_face(self.mesh, self.setup, layout=self.layout, rig_shapes=rig_shapes)

    @property
    def followers(self) -> Mapping[str, str]:
        """Blend shapes of other meshes that follow those of the face: `usdface.shot.followers`.

        Those with motion of their own in the base do not. The same motion as the face's is none:
        on an open stage the base is an earlier result.
        """
        pinned = {pin.shape for pin in self.setup.pins}
        labels = {s.name: s.label for mesh in self.rig.meshes for s in mesh.shapes if s.label}
        pairs = followers(self.rig.shape_names, self.mesh.shape_names, pinned, labels)
        return {own: lead for own, lead in pairs.items() if not self._moves_alone(own, lead)}

    def _moves_alone(self, own: str, lead: str) -> bool:
        """Return whether the base moves a blend shape, and otherwise than its lead."""
        if self.base is None or own not in self.base.names:
            return False
        names, weights = self.base.names, self.base.weights
        motion = weights[:, names.index(own)]
        of_lead = weights[:, names.index(lead)] if lead in names else 0.0
        return bool(np.any(motion)) and not np.allclose(motion, of_lead, rtol=0.0, atol=_SAME)

    def with_base(self, names: tuple[str, ...], weights: FloatArray) -> WeightsTake:
        """Return weights (F, S) of blend shapes `names` over the base: F frames, T columns.

        Columns are those of the base in its order, then the others. Blend shapes of other meshes
        that `followers` names have the weights of the face's.
        """
        base = self.base.names if self.base is not None else ()
        pairs = {own: lead for own, lead in self.followers.items() if own not in names}
        order = base + tuple(name for name in (*names, *pairs) if name not in base)
        complete = np.zeros((len(weights), len(order)))
        if self.base is not None:
            complete[:, : len(base)] = self.base.weights
        column = {name: i for i, name in enumerate(order)}
        complete[:, [column[name] for name in names]] = weights
        for own, lead in pairs.items():
            if lead in names:
                complete[:, column[own]] = complete[:, column[lead]]
        return WeightsTake(order, self.take.times, complete, self.take.rate)


@dataclass(frozen=True, eq=False, slots=True)
class SolvedShot:
    """A take that was cleaned and solved: the first stage, which takes nearly all of the time.

    Attributes
    ----------
    take : MarkerTake or WeightsTake
        Its markers cleaned.
    weights : WeightsTake
    solution : Solution or None
        None for a take of weights.
    repairs : tuple of Repair
    findings : tuple of Finding
    lids : mapping of "left", "right" to LidApertures, or None
        Of the blend shapes of `weights`; None where they were not measured.
    mistracked : tuple of MistrackedLid
        Lid markers that were not believed; `take` has them where they are instead.
    recorded : str
        `content_digest` of the take before its clean-up; "" where it was never read as a whole.
    """

    __repr__ = short_repr

    take: MarkerTake | WeightsTake
    weights: WeightsTake
    solution: Solution | None
    repairs: tuple[Repair, ...] = ()
    findings: tuple[Finding, ...] = ()
    lids: Mapping[Eye, LidApertures] | None = None
    mistracked: tuple[MistrackedLid, ...] = ()
    recorded: str = ""


@checked
@dataclass(frozen=True, eq=False, slots=True)
class ShotResult:
    """A retargeted shot.

    Attributes
    ----------
    shot : Shot
        As solved, with cleaned markers.
    solved : WeightsTake
        (F, T) weights before the correction, exaggerated, in [0, 1]; blend shapes in the order of
        `Shot.base`.
    corrected : (F, T) float64 or None
        Weights after it; None without an expression layer.
    solution : Solution or None
        The retarget of a marker take: head pose, residual, feature points; None of a weights take.
    head_motion : Pose or None
        Motion of the character's head in rig space; None if it stays still.
    eye_motions : tuple of JointMotion
        Of the joints that turn the character's eyes, on top of the head's.
    repairs : tuple of Repair
        Changes of the marker clean-up.
    region_residuals : mapping of str to (F,) float64 [m]
        RMS distance of the markers of each region from the solved face; empty of a weights take.
    closure : Closure or None
        Weights with closed eyes and lips, and where they close; None without a closure layer.
    trace : ExpressionTrace or None
        Features, firing strengths and emotions of the expression layer; None without one.
    findings : tuple of Finding
    solve : SolvedShot or None
        The solve that all of this was computed from: `usdface.process` starts from it where it is
        given this result. None of a result that was put together by hand.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda").value
    >>> result.weights.weights.shape == (len(result.shot.take.times), len(result.weights.names))
    True
    """

    __repr__ = short_repr

    shot: Shot
    solved: WeightsTake
    corrected: FloatArray | None = None
    closure: Closure | None = None
    solution: Solution | None = None
    head_motion: Pose | None = None
    eye_motions: tuple[JointMotion, ...] = ()
    repairs: tuple[Repair, ...] = ()
    region_residuals: Mapping[str, FloatArray] = field(default_factory=dict)
    trace: ExpressionTrace | None = None
    findings: tuple[Finding, ...] = ()
    solve: SolvedShot | None = None

    def __post_init__(self) -> None:
        freeze(self, "corrected")
        make_read_only((self.solution, self.trace, self.region_residuals))

    @property
    def weights(self) -> WeightsTake:
        """The final weights (F, T): those of the closure, expression or solve layer."""
        final = self.corrected if self.closure is None else self.closure.weights
        return self.solved if final is None else replace(self.solved, weights=final)

    @property
    def performed(self) -> WeightsTake:
        """The solved weights (F, T) before their exaggeration."""
        # A result that was put together by hand has the solution at most.
        own = self.solution if self.solve is None else self.solve
        if own is None or self.shot.factors.none:
            return self.solved
        return self.shot.with_base(own.weights.names, own.weights.weights)

    @property
    def emotions(self) -> Mapping[str, FloatArray]:
        """The curve (F,) of each emotion in [0, 1]; empty without an expression layer."""
        return self.trace.emotions if self.trace else {}
