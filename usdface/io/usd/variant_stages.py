"""A stage with another variant selected, beside the one that is shown."""

from pxr import Sdf, Usd

from usdface.io.usd.held_layers import hold_layers
from usdface.io.usd.stage import check_clocks

__all__ = ["stage_with_variant"]


def stage_with_variant(stage: Usd.Stage, path: Sdf.Path, name: str, variant: str) -> Usd.Stage:
    """Return the stage of the same layers on which a prim's set has this selection."""
    session = Sdf.Layer.CreateAnonymous(".usda")
    session.TransferContent(stage.GetSessionLayer())
    Sdf.CreatePrimInLayer(session, path).variantSelections[name] = variant
    other = Usd.Stage.Open(stage.GetRootLayer(), session)
    hold_layers(other)
    check_clocks(other)
    return other
