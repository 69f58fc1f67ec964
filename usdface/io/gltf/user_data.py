"""Where a glTF file has names, extensions and extras: its parts may have them anywhere.

Source: glTF 2.0 specification, section 3.1 (glTFProperty) and the JSON schemas.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["UserData", "user_data_of"]

_SINGULAR = {"meshes": "mesh", "bufferViews": "bufferView"}
_INNER = {"primitives": "a primitive", "channels": "a channel", "samplers": "a sampler"}


@dataclass(frozen=True, eq=False, slots=True)
class UserData:
    """The name, extensions and extras of one part of a file.

    Attributes
    ----------
    path : tuple of str and int
        Keys and numbers that lead to the part; () is the file.
    extensions : mapping
        By name; {} where there are none.
    extras : object
        Any JSON value; None where there are none.
    name : str
    """

    path: tuple[str | int, ...]
    extensions: Mapping[str, Any]
    extras: Any
    name: str = ""

    @property
    def where(self) -> str:
        """The part in words: "node 2", "a primitive of mesh 0", "the file"."""
        if not self.path:
            return "the file"
        kind = str(self.path[0])
        number = self.path[1:2]
        part = " ".join(map(str, (_SINGULAR.get(kind, kind.removesuffix("s")), *number)))
        inner = [str(step) for step in self.path[2:] if isinstance(step, str)]
        return " of ".join([*(_INNER.get(step, step) for step in reversed(inner)), part])


def user_data_of(document: Mapping[str, Any]) -> tuple[UserData, ...]:
    """Return the name, extensions and extras of every part of a document, in its order.

    Those within extensions and extras are theirs.
    """
    found = []
    waiting: list[tuple[tuple[str | int, ...], Any]] = [((), document)]
    while waiting:
        path, part = waiting.pop()
        if isinstance(part, Mapping):
            extensions, extras, name = map(part.get, ("extensions", "extras", "name"))
            if extensions or extras is not None or name:
                named = extensions if isinstance(extensions, Mapping) else {}
                found.append(UserData(path, named, extras, str(name or "")))
            inner = [(k, v) for k, v in part.items() if k not in ("extensions", "extras")]
        elif isinstance(part, list):
            inner = list(enumerate(part))
        else:
            continue
        waiting += [((*path, k), v) for k, v in reversed(inner) if isinstance(v, dict | list)]
    return tuple(found)
