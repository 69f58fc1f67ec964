"""A take of weights on the blend shapes of a rig."""

from dataclasses import replace

from usdface.blas_threads import one_blas_thread
from usdface.blend_shapes.combined_weights import combined_shapes, with_combinations
from usdface.face.bound_face import BoundFace
from usdface.face.curve_mapping import rename_weights
from usdface.face.weights_from_neutral import weights_from_neutral
from usdface.findings import Finding
from usdface.retarget.pins import pins_of_combinations, with_pins
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

__all__ = ["recorded_weights"]


@one_blas_thread()
def recorded_weights(
    take: WeightsTake, face: BoundFace, setup: RetargetSetup
) -> tuple[WeightsTake, list[Finding]]:
    """Return a take of weights on the rig's blend shapes, with its pins and combination shapes."""
    take, findings = weights_from_neutral(take, setup)
    weights, new_findings = rename_weights(take, face.rig_shapes, setup.curves)
    findings += new_findings
    findings += pins_of_combinations(setup.pins, combined_shapes(face.mesh.shapes))
    pinned = with_pins(setup.pins, weights.names, weights.times, weights.weights)
    combined = with_combinations(face.mesh.shapes, weights.names, pinned)
    return replace(weights, weights=combined), findings
