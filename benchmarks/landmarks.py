"""Places of a tracker's 68 landmarks in the image of one camera: `python -m benchmarks.landmarks`.

On three heads, nothing given: distances to known vertices, and on the first, whose true weights are
known, weight RMS errors with the markers held on the proposed vertices, with places that the solve
refines, and with known ones. See README.md.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.one_camera import BEND, DATA, PARTS, REST, film, off
from benchmarks.solve.faces import Face, bent, ict
from usdface.binding.propose_film import propose_film
from usdface.face.bound_face import bound_face
from usdface.options import SolveOptions
from usdface.retarget_take.solve import solve
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from faces import make_face

FILMED, FIRST_INNER = 600, 17  # frames of the film; of iBUG's landmarks, the first that is no jaw


def main() -> None:
    """Print the table."""
    nothing = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))
    part, face = PARTS["end"], ict(DATA)
    face = replace(face, curves=face.curves[part.start :][:FILMED])
    performer = bent(face, part.seed, BEND)
    table = Table(title="landmarks of an image: distance to known vertices, medians")
    heads = ("head", "turns", "bound", "with a place", "all", "from the brows to the mouth")
    for column in (*heads, "weights: held there", "refined", "known places"):
        table.add_column(column, justify="right")
    for head, angle in product(("ict68", "makehuman68", "example68"), (0.0, 20.0)):
        take, _ = film(face, performer, angle, part)
        take = replace(take, names=tuple(f"landmark_{i}" for i in range(len(take.names))))
        made = make_face(head, DATA)
        points = made.mesh.points
        true = vertex_of_number(made.setup.binding)
        proposal = propose_film(take, made.mesh, nothing)
        bound = proposal.setup.binding
        found = vertex_of_number(bound)
        off = {
            number: float(np.linalg.norm(points[found[number]] - points[true[number]]))
            for number in sorted(found.keys() & true.keys())
        }
        inner = [length for number, length in off.items() if number >= FIRST_INNER]
        errors = [f"{1000 * np.median(each):.1f} mm" for each in (list(off.values()), inner)]
        count = str(len(proposal.placed))
        if head == "ict68":  # whose true weights are known
            take = replace(take, focal_length=part.focal_length)
            errors += [f"{error:.3f}" for error in filmed_weights(take, made.mesh, bound, face)]
        table.add_row(head, f"{angle:g} degrees", str(len(bound.markers)), count, *errors)
    Console(width=130).print(table)


def filmed_weights(take: MarkerTake, mesh: Mesh, bound: Binding, truth: Face) -> Iterator[float]:
    """Yield weight RMS errors with places held on vertices, refined, and with known ones."""
    known = dict(
        zip((f"landmark_{i}" for i in range(len(truth.points))), truth.points, strict=True)
    )
    right = Binding(bound.markers, np.array([known[name] for name in bound.markers]))
    for binding, places in ((bound, "bound"), (bound, "found"), (right, "found")):
        options = SolveOptions(places=places)
        setup = RetargetSetup(binding, neutral=(0, REST - 1), solve=options)
        solution, _ = solve(take, bound_face(mesh, setup), setup, cleaned=None)
        weights = solution.weights
        yield off(truth, weights.weights)


def vertex_of_number(binding: Binding) -> dict[int, int]:
    """Return the vertices of markers by the number at the end of their names."""
    numbers = [int("".join(filter(str.isdigit, name))) for name in binding.markers]
    return dict(zip(numbers, binding.points.tolist(), strict=True))


if __name__ == "__main__":
    main()
