"""Names of morph targets, unique and encodable."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pygltflib import Accessor
from pygltflib import Mesh as GltfMesh

from usdface.findings import Finding, finding
from usdface.rigs import Mesh

__all__ = ["legal_text", "target_names", "unique_names", "with_labels"]


def target_names(
    mesh: GltfMesh, name: str, of_node: Any, accessors: Sequence[Accessor | None]
) -> tuple[tuple[str, ...], tuple[str, ...], list[Finding]]:
    """Return a unique name for each morph target, its original name, and findings.

    Names stand in ``extras.targetNames`` of the mesh, as most programs write them, of a primitive
    (UniVRM) or of the node. Else, as in Blender's importer, the names of the accessors of positions
    serve, where each target has one of its own; and else ``target_0``, ``target_1``, ...

    Parameters
    ----------
    mesh : pygltflib.Mesh
        One without primitives, as of a file of animations, has as many targets as it names.
    name : str
        Name of the mesh in findings.
    of_node : object
        The extras of the node that shows the mesh.
    accessors : sequence of pygltflib.Accessor
        Those of the document.
    """
    extras = mesh.extras if isinstance(mesh.extras, Mapping) else {}
    primitives = mesh.primitives or []
    stated = (each.get("targetNames") for each in _all_extras(mesh, of_node))
    given = next((texts for names in stated if (texts := _texts(names))), [])
    count = len(primitives[0].targets or []) if primitives else len(given)
    found = []
    if given and len(given) != count:
        message = "there are {name_count} targetNames for {shape_count} morph targets"
        found.append(finding("NAME_CHANGED", name, message, len(given), count))
    if count and not given:
        given = _names_of_accessors(primitives[0].targets, accessors)
        message = "its accessors have some, which are taken" if given else "they are numbered"
        message = f"there are no targetNames for {{shape_count}} morph targets: {message}"
        found.append(finding("SHAPE_NAMES_ASSUMED", name, message, count))
    names = [given[k] if k < len(given) and given[k] else f"target_{k}" for k in range(count)]
    ours = extras.get("usdface")
    own = _texts(ours.get("names")) if isinstance(ours, Mapping) else []
    if len(own) == count == len(set(own)) and all(own):  # an export made them unique already
        return tuple(own), tuple(map(legal_text, names)), found
    unique, changed = unique_names(names, f"blend shape of {name}")
    return unique, tuple(map(legal_text, names)), found + changed


def _all_extras(mesh: GltfMesh, of_node: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the extras that may name the targets of a mesh, the most usual first."""
    for extras in (mesh.extras, *(each.extras for each in mesh.primitives or []), of_node):
        if isinstance(extras, Mapping):
            yield extras


def _names_of_accessors(
    targets: Sequence[Mapping[str, Any]], accessors: Sequence[Accessor | None]
) -> list[str]:
    """Return the names of the positions of targets, if all have one and none has another's."""
    places = [target.get("POSITION") for target in targets]
    known = [k for k in places if isinstance(k, int) and 0 <= k < len(accessors)]
    held = [accessors[k] for k in known]
    names = [legal_text(each.name) for each in held if each is not None and each.name]
    return names if len(set(names)) == len(targets) else []


def _texts(values: object) -> list[str]:
    sound = isinstance(values, list) and all(isinstance(v, str) for v in values)
    return [legal_text(v) for v in values] if isinstance(values, list) and sound else []


def with_labels(mesh: Mesh | None, labels: tuple[str, ...]) -> Mesh | None:
    """Return a mesh whose shapes know their original names, where these are others."""
    if mesh is None or mesh.shape_names == labels:
        return mesh
    shapes = zip(mesh.shapes, labels, strict=True)
    named = (s if s.name == label else replace(s, label=label) for s, label in shapes)
    return replace(mesh, shapes=tuple(named))


def unique_names(given: list[str], subject: str) -> tuple[tuple[str, ...], list[Finding]]:
    """Return names made unique by a number behind, and a finding for each changed one."""
    taken = {legal_text(name) for name in given}
    seen: set[str] = set()
    result, found = [], []
    for original in map(legal_text, given):
        name, number = original, 1
        while name in seen or (number > 1 and name in taken):
            number += 1
            name = f"{original}_{number}"
        seen.add(name)
        if name != original:
            found.append(
                finding("NAME_CHANGED", original, f"{subject} name occurs twice: {{name!r}}", name)
            )
        result.append(name)
    return tuple(result), found


def legal_text(name: str) -> str:
    """Return a name that can be encoded: JSON allows half of a surrogate pair."""
    return name.encode("utf-8", "replace").decode()
