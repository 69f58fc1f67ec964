"""The clean-up of a take whose markers are bound."""

from usdface.blas_threads import one_blas_thread
from usdface.cleanup.clean import Cleaned, clean_take
from usdface.findings import Finding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["clean", "clean_inputs"]


@one_blas_thread()
def clean(take: MarkerTake, setup: RetargetSetup) -> tuple[Cleaned, list[Finding]]:
    """Clean the markers of a take as its setup says."""
    face_markers = (*setup.binding.markers, *setup.head_markers)
    moving = setup.head != "stabilised"
    return clean_take(take, face_markers, setup.clean, moving=moving, neutral=_named_neutral(setup))


@one_blas_thread()
def clean_inputs(take: MarkerTake, setup: RetargetSetup) -> tuple[object, ...]:
    """Return all that `clean` depends on: bound labels, neutral frames, nothing else of the rig.

    In the order of the take, in which the clean-up processes them.
    """
    face_markers = {*setup.binding.markers, *setup.head_markers}
    chosen = tuple(name in face_markers for name in take.names)
    return take, chosen, setup.clean, setup.head != "stabilised", _named_neutral(setup)


def _named_neutral(setup: RetargetSetup) -> tuple[int, int] | None:
    """Return the neutral frames that were named or found, in which the markers are bound."""
    return None if setup.neutral_assumed else setup.neutral
