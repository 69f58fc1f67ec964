"""Values of a mesh that are computed once and kept with it."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from usdface.rigs.mesh import Mesh

__all__ = ["once_per_mesh"]

ValueT = TypeVar("ValueT")


def once_per_mesh(compute: Callable[[Mesh], ValueT]) -> Callable[[Mesh], ValueT]:
    """Compute a function of a mesh alone once for each mesh, which never changes.

    For what most steps of a job need and is slow on dense meshes. The value is kept in the
    instance, as `functools.cached_property` keeps one, and freed with it; so a package above that
    of meshes can have one, too.
    """
    key = f"{compute.__module__}.{compute.__qualname__}"

    @wraps(compute)
    def kept(mesh: Mesh) -> ValueT:
        known = vars(mesh)
        if key not in known:
            known[key] = compute(mesh)
        value: ValueT = known[key]
        return value

    return kept
