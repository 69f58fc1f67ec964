"""Names of morph targets, unique and encodable."""

from collections.abc import Mapping
from dataclasses import replace

from pygltflib import Mesh as GltfMesh

from usdface.findings import Finding, finding
from usdface.rigs import Mesh

__all__ = ["legal_text", "target_names", "unique_names", "with_labels"]


def target_names(
    mesh: GltfMesh, name: str
) -> tuple[tuple[str, ...], tuple[str, ...], list[Finding]]:
    """Return a unique name for each morph target, its original name, and findings.

    A mesh without primitives, as of a file of animations, has as many as it names.
    """
    extras = mesh.extras if isinstance(mesh.extras, Mapping) else {}
    given = _texts(extras.get("targetNames"))
    count = len(mesh.primitives[0].targets or []) if mesh.primitives else len(given)
    found = []
    if given and len(given) != count:
        message = "there are {name_count} targetNames for {shape_count} morph targets"
        found.append(finding("NAME_CHANGED", name, message, len(given), count))
    names = [given[k] if k < len(given) and given[k] else f"target_{k}" for k in range(count)]
    ours = extras.get("usdface")
    own = _texts(ours.get("names")) if isinstance(ours, Mapping) else []
    if len(own) == count == len(set(own)) and all(own):  # an export made them unique already
        return tuple(own), tuple(map(legal_text, names)), found
    unique, changed = unique_names(names, f"blend shape of {name}")
    return unique, tuple(map(legal_text, names)), found + changed


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
