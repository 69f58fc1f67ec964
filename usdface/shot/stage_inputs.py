"""Inputs of the stages of a retarget: with equal ones, an earlier result is still right."""

from dataclasses import replace

from usdface.options import ClosureOptions
from usdface.retarget.recorded_eyes import turning_joints
from usdface.shot.shot import Shot

__all__ = ["express_inputs", "inputs_beside_take", "solve_inputs"]


def solve_inputs(shot: Shot) -> object:
    """Return all that the solve of a shot depends on."""
    return shot.take, inputs_beside_take(shot)


def inputs_beside_take(shot: Shot) -> object:
    """Return all that the solve of a shot depends on beside its take."""
    setup = replace(shot.setup, closure=ClosureOptions(), exaggeration={})
    return shot.mesh, shot.rig.shape_names, setup, shot.layout


def express_inputs(shot: Shot) -> object:
    """Return all that correction and closure depend on beside the solve."""
    system, names = (shot.system, shot.expressions, shot.layout, shot.gains), shot.rig.shape_names
    # A recorded head turns about its joint, eyes about theirs.
    joints = shot.rig.skeleton, turning_joints(shot.rig, shot.setup)
    return shot.mesh, joints, names, shot.setup, system, shot.base, shot.factors
