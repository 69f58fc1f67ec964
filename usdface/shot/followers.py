"""Blend shapes of other meshes that move as the face's of the same name, behind other node names.

Programs that name blend shapes after a node have one for each mesh: ``head_bs.jawOpen`` and
``teeth_bs.jawOpen`` are two weights, and one movement. So are ``jawOpen`` and ``jawOpen2`` where a
program counted through the names of all meshes.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.shape_aliases import bare_name, is_counted

__all__ = ["followers", "with_followers"]


def followers(
    rig_shapes: Iterable[str],
    face_shapes: Sequence[str],
    moving: Collection[str] = (),
    labels: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """Return the blend shapes of other meshes with those of the face that they follow.

    Parameters
    ----------
    rig_shapes : iterable of str
    face_shapes : sequence of str
        Of the face; where several have one name behind their nodes, none of these is followed.
    moving : collection of str
        Blend shapes that have motion of their own, which they keep. So do those that the reader
        told apart as ``mesh:name``.
    labels : mapping of str to str
        The names that blend shapes had before they were made unique (`BlendShape.label`).

    Examples
    --------
    >>> followers(["head_bs.jawOpen", "teeth_bs.jawOpen", "hat_bs.tilt"], ["head_bs.jawOpen"])
    {'teeth_bs.jawOpen': 'head_bs.jawOpen'}
    """

    def own_name(name: str) -> str:
        label = labels.get(name, "")
        return bare_name(label if is_counted(name, label) else name)

    bare = [own_name(name) for name in face_shapes]
    leaders = {
        own: name
        for own, name in zip(bare, face_shapes, strict=True)
        if bare.count(own) == 1 and any(letter.isalpha() for letter in own)
    }
    kept = {*face_shapes, *moving}
    others = [name for name in rig_shapes if name not in kept and ":" not in name]
    return {name: leaders[own] for name in others if (own := own_name(name)) in leaders}


def with_followers(
    pairs: Mapping[str, str], names: Sequence[str], before: FloatArray, after: FloatArray
) -> FloatArray:
    """Return corrected weights of which followers changed by as much as their leaders.

    Those that the correction itself changed do not follow: their expression poses name them.

    Parameters
    ----------
    pairs : mapping of str to str
        As `followers` returns them.
    names : sequence of str, length T
    before, after : (F, T) float64
        Weights before the correction and after it.

    Returns
    -------
    (F, T) float64
        Within 0 to 1 where something follows.

    Examples
    --------
    >>> before, after = np.array([[0.25, 0.25]]), np.array([[0.5, 0.25]])
    >>> with_followers({"teeth": "face"}, ("face", "teeth"), before, after).tolist()
    [[0.5, 0.5]]
    """
    column = {name: i for i, name in enumerate(names)}
    known = [(column[f], column[of]) for f, of in pairs.items() if {f, of} <= column.keys()]
    known = [(own, lead) for own, lead in known if np.array_equal(after[:, own], before[:, own])]
    if not known:
        return after
    own, lead = (list(each) for each in zip(*known, strict=True))
    moved = after.copy()
    moved[:, own] = np.clip(after[:, own] + after[:, lead] - before[:, lead], 0.0, 1.0)
    return moved
