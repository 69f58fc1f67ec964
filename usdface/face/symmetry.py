"""Which blend shapes of a rig are each other's mirror image, by name."""

import numpy as np

from usdface.arrays import IntArray
from usdface.face.shape_names import shape_key

__all__ = ["symmetric_pairs"]

# Left and right of these are directions, not sides: nobody does both at once.
_DIRECTIONS = frozenset(("jaw", "mouth", "tongue", "head", "nose"))


def symmetric_pairs(names: tuple[str, ...]) -> IntArray:
    """Return the left and the right shape of each pair: (P, 2) int64 into `names`.

    Names are read in any spelling: ``mouthSmileLeft``, ``mouthSmile_L``. Directions as in
    ``jawLeft``, and of the eyes' look inwards and outwards, are no pairs.
    """
    sides: dict[str, dict[str, int]] = {}
    for i, name in enumerate(names):
        base, side = shape_key(name)
        directed = base in _DIRECTIONS or base in ("eyelookin", "eyelookout")
        if side and not directed:
            sides.setdefault(base, {}).setdefault(side, i)
    pairs = [(pair["left"], pair["right"]) for pair in sides.values() if len(pair) == 2]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
