"""Joints as they stand at rest or in the frames of a clip, as skinning transforms."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import JointsTake
from usdface.io.transforms import compose
from usdface.rigs import Skeleton

__all__ = ["skinning_transforms"]


def skinning_transforms(skeleton: Skeleton, take: JointsTake | None = None) -> FloatArray:
    """Return the transforms (F, J, 4, 4) from rig space at bind time to that of each frame.

    Row vectors. Without a take there is one frame, the rest pose; joints that a take does not
    name stay there.
    """
    frames = 1 if take is None else len(take.times)
    world = np.tile(skeleton.rest, (frames, 1, 1, 1))
    if take is not None:
        places = {joint: k for k, joint in enumerate(skeleton.joints)}
        own = [places[joint] for joint in take.joints]
        world[:, own] = compose(take.translations, take.rotations, take.scales)
    for k, parent in enumerate(skeleton.parents):
        if parent >= 0:
            world[:, k] = world[:, k] @ world[:, parent]
    return np.asarray(np.linalg.pinv(skeleton.bind) @ world)
