"""A complete binding of a shot, or one that is too unsure."""

from dataclasses import dataclass

from usdface.binding.proposal import Proposal
from usdface.errors import InputError
from usdface.rigs import Mesh
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

__all__ = ["ResolvedBinding", "UnsureBindingError"]


@dataclass(frozen=True, eq=False, slots=True)
class ResolvedBinding:
    """A bound mesh, and the setup with binding, neutral and peak frames.

    Attributes
    ----------
    mesh : Mesh
        The bound one.
    setup : RetargetSetup
        Peak frames are in it where they are named, requested or used to propose vertices.
    proposal : Proposal or None
        None where all vertices are given.
    missing : tuple of str
        Bound markers that the take does not have.
    unbound : tuple of str
        Markers of the take that the binding leaves out; a proposal may bind them.
    neutral_found : bool
        The neutral frames were detected.
    other_take : str
        The take whose neutral and peak frames the binding names, if it is another; "" if not.
    by_unit : tuple of str
        Curves that drive blend shapes of another name, of the same action units.
    driving : WeightsTake or None
        Of a take of weights the curves that drive blend shapes or the gaze.
    mesh_assumed : bool
        Vertices are given without the name of their mesh, and several have blend shapes.
    """

    mesh: Mesh
    setup: RetargetSetup
    proposal: Proposal | None = None
    missing: tuple[str, ...] = ()
    unbound: tuple[str, ...] = ()
    neutral_found: bool = False
    other_take: str = ""
    by_unit: tuple[str, ...] = ()
    driving: WeightsTake | None = None
    mesh_assumed: bool = False


class UnsureBindingError(InputError):
    """More proposed vertices are unsure than markers are bound.

    Parameters
    ----------
    message : str
    mesh : Mesh
    setup : RetargetSetup
        The proposal, for a person to check.
    """

    def __init__(self, message: str, mesh: Mesh, setup: RetargetSetup) -> None:
        super().__init__(message, "BINDING_UNSURE")
        self.mesh, self.setup = mesh, setup
