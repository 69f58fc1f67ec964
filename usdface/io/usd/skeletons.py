"""The skeletons of a stage as one: a rig has a single skeleton, whose roots may be many."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Sdf

from usdface.io.prim_names import prim_names
from usdface.rigs import Skeleton

__all__ = ["StagedSkeleton", "join_skeletons"]


@dataclass(frozen=True, eq=False, slots=True)
class StagedSkeleton:
    """A skeleton on a stage, and where its joints are in that of the rig.

    Attributes
    ----------
    path : Sdf.Path
    skeleton : Skeleton
        Joints as the stage names them.
    joints : tuple of str, length J
        The same joints as the rig names them.
    """

    path: Sdf.Path
    skeleton: Skeleton
    joints: tuple[str, ...]

    @property
    def renamed(self) -> Mapping[str, str]:
        """Joint paths of the rig by those of the stage."""
        return dict(zip(self.skeleton.joints, self.joints, strict=True))


def join_skeletons(
    skeletons: Sequence[tuple[Sdf.Path, Skeleton]],
) -> tuple[Skeleton | None, tuple[StagedSkeleton, ...]]:
    """Return the skeletons side by side as one; a root whose name is taken gets a number."""
    staged: list[StagedSkeleton] = []
    taken: list[str] = []
    for path, skeleton in skeletons:
        roots = list(dict.fromkeys(joint.partition("/")[0] for joint in skeleton.joints))
        unique = roots
        if set(roots) & set(taken):
            unique = list(prim_names(roots, taken))
        taken += unique
        names = dict(zip(roots, unique, strict=True))
        joints = tuple(
            "/".join([names[joint.partition("/")[0]], *joint.split("/")[1:]])
            for joint in skeleton.joints
        )
        staged.append(StagedSkeleton(path, skeleton, joints))
    if not staged:
        return None, ()
    parts = [one.skeleton for one in staged]
    whole = Skeleton(
        tuple(joint for one in staged for joint in one.joints),
        tuple(name for part in parts for name in part.names),
        np.concatenate([part.bind for part in parts]),
        np.concatenate([part.rest for part in parts]),
        next((part.skin_name for part in parts if part.skin_name), ""),
    )
    return whole, tuple(staged)
