"""Proposed bindings of markers in an image, of which no neutral frames are named."""

from dataclasses import replace

from usdface.binding.bound_neutral import bound_neutral
from usdface.binding.neutral_frames import shows_poses
from usdface.binding.proposal import Proposal
from usdface.binding.propose import propose
from usdface.face.bound_face import bound_face
from usdface.rigs import Mesh
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["propose_film"]


def propose_film(take: MarkerTake, mesh: Mesh, setup: RetargetSetup) -> Proposal:
    """Propose the vertex of each marker that has none, from neutral frames that are found.

    Depths by names alone are too rough to judge held poses, so they are judged once more with the
    markers on the proposed vertices. If another neutral is found, the vertices are proposed again.

    Parameters
    ----------
    take : MarkerTake
        Of an image.
    mesh : Mesh
    setup : RetargetSetup
        As in `usdface.binding.propose.propose`.

    Raises
    ------
    InputError
        As `usdface.binding.propose.propose`.
    """
    proposal = propose(take, mesh, setup, find_neutral=True)
    if not shows_poses(take, proposal.setup.binding.markers):
        return proposal
    neutral = bound_neutral(take, bound_face(mesh, proposal.setup))
    if neutral == proposal.setup.neutral:
        return proposal
    return propose(take, mesh, replace(setup, neutral=neutral))
