"""Neutral weights that are found on characters of another model than the performers'.

Such a rig lacks some of the performer's movements; what it lacks is no expression of the neutral.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.binding import head_mesh
from benchmarks.performers.shown_neutral import with_neutral
from benchmarks.solve.faces import ROOT, Face
from usdface.face.bound_face import bound_face
from usdface.io.bind_file import read_bind
from usdface.retarget_take.solve import solve
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["OTHER_HEADS", "neutrals_on"]

OTHER_HEADS = ("makehuman", "example")


def neutrals_on(
    head: str, data: Path, face: Face, numbers: Sequence[int], shows: str
) -> list[dict[str, float]]:
    """Return the neutral weights found for each performer, with AnimFace's 41 markers.

    Parameters
    ----------
    head : str
        Of `OTHER_HEADS`.
    data : Path
    face : Face
        That performs.
    numbers : sequence of int
        Performers.
    shows : str
        Of `NEUTRALS`: the truth.
    """
    mesh, found = head_mesh(head), []
    worn, bound = (_places(name) for name in ("ict", head))
    names = tuple(worn)
    points = np.array([bound[name] for name in names])
    for number in numbers:
        markers = np.array([worn[name] for name in names])
        performed = with_neutral(data, number, shows, face.mesh.shape_names, markers)
        count = len(performed.positions)
        take = MarkerTake(names, np.arange(count) / face.rate, performed.positions, face.rate)
        binding = Binding(names, points, mesh.name)
        setup = RetargetSetup(binding, neutral=(0, performed.neutral_frames - 1))
        solution, _ = solve(take, bound_face(mesh, setup), setup, cleaned=None)
        assert solution is not None
        found.append(dict(solution.neutral_weights))
    return found


def _places(head: str) -> dict[str, int]:
    bind, _ = read_bind(ROOT / "tests" / "data" / f"animface_{head}_bind.json")
    return dict(zip(bind.binding.markers, bind.binding.points.tolist(), strict=True))
