"""An immutable mapping that pickles."""

from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

__all__ = ["FrozenMapping"]

KeyT = TypeVar("KeyT")
ValueT = TypeVar("ValueT", covariant=True)


class FrozenMapping(Mapping[KeyT, ValueT], Generic[KeyT, ValueT]):
    """A copy of a mapping that nobody changes: the field of an immutable dataclass.

    `types.MappingProxyType` can neither be pickled nor copied, so a result with one could not leave
    its process, for a pool of workers or a cache.

    Parameters
    ----------
    items : mapping
    """

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[KeyT, ValueT]) -> None:
        self._items = dict(items)

    def __getitem__(self, key: KeyT) -> ValueT:
        return self._items[key]

    def __iter__(self) -> Iterator[KeyT]:
        return iter(self._items)

    def __reversed__(self) -> Iterator[KeyT]:
        return reversed(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return repr(self._items)

    def __or__(self, other: Mapping[Any, Any]) -> dict[Any, Any]:
        return {**self, **other}

    def __ror__(self, other: Mapping[Any, Any]) -> dict[Any, Any]:
        return {**other, **self}

    def copy(self) -> dict[KeyT, ValueT]:
        """Return the items as a dict that may be changed."""
        return self._items.copy()
