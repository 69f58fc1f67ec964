"""pygltflib's objects for the JSON of a document.

dataclasses-json, which pygltflib reads with, looks up the types of a class again for each object:
0.16 ms each, forty seconds for the largest file that is read. Here they are looked up once.
"""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from pygltflib import GLTF2, Attributes

__all__ = ["decode_document"]


def decode_document(values: Any) -> GLTF2:
    """Return the document of parsed JSON, as ``GLTF2.from_json(..., infer_missing=True)`` does.

    Numbers and strings are converted to the type of their field; members that pygltflib lacks are
    left out, and lists or objects are not accepted for one another.

    Raises
    ------
    AttributeError, KeyError, TypeError, ValueError, OverflowError
        If a value does not fit its field.
    """
    document = _decoder(GLTF2)(values)
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            if isinstance(primitive.attributes, dict) and primitive.attributes:
                primitive.attributes = Attributes(**primitive.attributes)
    return document


@cache
def _decoder(kind: Any) -> Callable[[Any], Any]:
    """Return the function that makes a value of a type of pygltflib from its JSON."""
    if is_dataclass(kind):
        return _object_decoder(kind)
    arguments = get_args(kind)
    if type(None) in arguments:  # Optional[X]
        return _decoder(next(one for one in arguments if one is not type(None)))
    if get_origin(kind) is list:
        one = _decoder(arguments[0])
        return lambda values: [one(value) for value in _checked(values, list)]
    if get_origin(kind) is dict or kind is Attributes:
        return lambda value: _checked(value, dict)
    return lambda value: value if isinstance(value, kind) else kind(value)


def _object_decoder(kind: Any) -> Callable[[Any], Any]:
    hints = get_type_hints(kind)
    decoders = {field.name: _decoder(hints[field.name]) for field in fields(kind)}

    def decoded(values: Any) -> Any:
        if values is None:  # in a list; `item` tells of it where it is needed
            return None
        known = {name: value for name, value in values.items() if name in decoders}
        return kind(**{n: None if v is None else decoders[n](v) for n, v in known.items()})

    return decoded


def _checked(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"expected {kind.__name__}, found {type(value).__name__}")
    return value
