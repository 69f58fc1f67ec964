"""Values that are computed once for a mesh and kept with it."""

import copy
import gc
import pickle
import weakref
from dataclasses import fields, replace

from usdface.content_digest import content_digest
from usdface.rigs import Mesh
from usdface.rigs.once_per_mesh import once_per_mesh

POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
COMPUTED: list[str] = []


@once_per_mesh
def width(mesh: Mesh) -> float:
    """Return the width of a mesh."""
    COMPUTED.append(mesh.name)
    return float(mesh.points[:, 0].max())


def triangle(name: str) -> Mesh:
    return Mesh(name, POINTS, [3], [0, 1, 2])  # type: ignore[arg-type]


def test_it_is_computed_once_for_each_mesh() -> None:
    COMPUTED.clear()
    mesh = triangle("a")
    larger = replace(mesh, name="b", points=2.0 * mesh.points)
    assert [width(mesh), width(larger), width(mesh), width(larger)] == [1.0, 2.0, 1.0, 2.0]
    assert COMPUTED == ["a", "b"]


def test_a_copy_with_other_points_computes_it_anew() -> None:
    mesh = triangle("a")
    assert width(mesh) == 1.0
    assert width(replace(mesh, points=3.0 * mesh.points)) == 3.0


def test_the_mesh_is_freed_with_it() -> None:
    mesh = triangle("a")
    width(mesh)
    there = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert there() is None


def test_the_content_of_the_mesh_stays() -> None:
    mesh = triangle("a")
    before = content_digest(mesh), repr(mesh)
    width(mesh)
    assert (content_digest(mesh), repr(mesh)) == before
    assert content_digest(pickle.loads(pickle.dumps(mesh))) == before[0]


def test_a_pickle_or_copy_has_the_fields_alone_and_read_only_arrays() -> None:
    mesh = triangle("a")
    width(mesh)
    for again in (pickle.loads(pickle.dumps(mesh)), copy.deepcopy(mesh), copy.copy(mesh)):
        assert vars(again).keys() == {field.name for field in fields(Mesh)}
        assert not again.points.flags.writeable


def test_the_function_keeps_its_name() -> None:
    assert (width.__name__, width.__doc__) == ("width", "Return the width of a mesh.")
